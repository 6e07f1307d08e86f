# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Kernels are kept between runs where that is possible, and work where it is not."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

import pytest

from adhesion_node.core import compiled
from adhesion_node.core.bank import kernels as of_bank
from adhesion_node.core.bank import layout
from adhesion_node.core.bank.labels import kinds
from adhesion_node.core.methods import kernels as of_methods
from adhesion_node.core.methods.kernels import equation
from adhesion_node.core.physics.train import GRAVITY

MODULES = {
    package: [import_module(f"{package.__name__}.{each.name}") for each in iter_modules(package.__path__)]
    for package in (of_bank, of_methods)
}
EACH = [(package, module) for package, modules in MODULES.items() for module in modules]
NAMED = {of_bank: {**vars(kinds), **vars(layout)}, of_methods: vars(equation)}
"""Where the constants stand that a kernel file repeats."""

USE = """
import numpy
from adhesion_node.core.bank.kernels.weighing import normalised
print(normalised(numpy.zeros(4), -numpy.inf)[0])
"""


def _used(folder: Path, before: str = "") -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    used = [sys.executable, "-c", before + USE]
    shown = subprocess.run(used, env=environment, capture_output=True, text=True, check=True)
    assert float(shown.stdout) == pytest.approx(-1.3862943611)


@pytest.fixture(scope="module")
def once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What one use keeps: to compile takes longer than to copy."""
    folder = tmp_path_factory.mktemp("kept")
    _used(folder)
    return folder


@pytest.fixture
def kept(once: Path, tmp_path: Path) -> Path:
    """A copy of it that a test may spoil."""
    return shutil.copytree(once, tmp_path / "kept")


def _files(folder: Path) -> dict[Path, tuple[int, bytes]]:
    return {file: (file.stat().st_mtime_ns, file.read_bytes()) for file in folder.rglob("*.nb?")}


def test_what_is_compiled_is_kept_in_the_cache_that_is_named(kept: Path) -> None:
    assert {path.name.partition("-")[0] for path in kept.rglob("*.nbi")} >= {"weighing.normalised"}


def test_what_is_kept_is_used_and_left_as_it_is(kept: Path) -> None:
    """A copy, too: else a test that spoils one would see it written anew whatever it has spoilt."""
    before = _files(kept)
    _used(kept)
    assert _files(kept) == before


@pytest.mark.parametrize(("ending", "left"), [("nbi", b""), ("nbi", bytes(500)), ("nbc", b""), ("nbc", bytes(500))])
def test_files_that_a_power_cut_has_left_are_written_anew(kept: Path, ending: str, left: bytes) -> None:
    """They ended every later start."""
    cut = list(kept.rglob(f"*.{ending}"))
    for file in cut:
        file.write_bytes(left)
    _used(kept)
    assert cut
    assert not [file for file in cut if file.read_bytes() == left]


def test_code_of_which_a_part_is_lost_is_compiled_anew(kept: Path) -> None:
    """A block of zeros in its midst: it was run."""
    for file in kept.rglob("*.nbc"):
        content = bytearray(file.read_bytes())
        content[len(content) // 3 : len(content) // 3 + 2000] = bytes(2000)
        file.write_bytes(content)
    _used(kept)


def test_a_kernel_works_where_the_disk_is_full(tmp_path: Path) -> None:
    """No file may have a byte: as on a full disk, an empty one can be made."""
    _used(tmp_path, "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))")
    assert not [file for file in tmp_path.rglob("*.nb?") if file.stat().st_size]
    _used(tmp_path)
    assert [file for file in tmp_path.rglob("*.nbc") if file.stat().st_size]


def test_the_code_of_another_version_has_another_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who was stopped between the list of what is kept and the code itself left the list of one, the other's code."""
    source, codes = tmp_path / "versions.py", list[set[str]]()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    for version in (1, 22):
        source.write_text(
            f"from adhesion_node.core.compiled import kernel\n@kernel\ndef one(x):\n    return x + {version}\n"
        )
        used = [sys.executable, "-c", "import versions; print(versions.one(0))"]
        shown = subprocess.run(used, cwd=tmp_path, capture_output=True, text=True, check=True)
        assert int(shown.stdout) == version
        codes.append({file.name for file in tmp_path.rglob("*.nbc")} - (codes[0] if codes else set()))
    assert [len(each) for each in codes] == [1, 1]


def test_a_kernel_works_where_nothing_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[dict[str, Any]] = []

    def njit(**options: Any) -> Callable[[Any], Any]:
        asked.append(options)

        def compiling(function: Any) -> Any:
            if options.get("cache"):
                raise RuntimeError("cannot cache function: no locator available for file")  # as numba says it
            return function

        return compiling

    monkeypatch.setattr(compiled, "njit", njit)
    assert compiled.kernel(abs)(-2) == 2
    assert asked == [{"cache": True, "error_model": "numpy"}, {"error_model": "numpy"}]


@pytest.mark.parametrize(("package", "module"), EACH, ids=[module.__name__ for _, module in EACH])
def test_a_kernel_file_stands_alone(package: Any, module: Any) -> None:
    """What is kept of it is thrown away when its own file changes: nothing of another file may be compiled in."""
    with open(module.__file__, encoding="utf-8") as file:
        tree = ast.parse(file.read())
    found = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    names = {alias.name for node in found for alias in node.names}
    numbers = {**NAMED[package], "GRAVITY": GRAVITY}.items()
    constants = {name: value for name, value in numbers if isinstance(value, int | float)}
    for name, value in vars(module).items():
        if isinstance(value, int | float) and name in constants:
            assert value == constants[name], name
    assert names <= {"annotations", "math", "numpy", "NDArray", "kernel", "TYPE_CHECKING", "NamedTuple"}


@pytest.mark.parametrize("modules", MODULES.values(), ids=[package.__name__ for package in MODULES])
def test_what_a_kernel_file_repeats_of_another_is_the_same(modules: Any) -> None:
    """Functions of the same name and arguments that are private to their files."""
    found: dict[tuple[str, str], set[str]] = {}
    for module in modules:
        with open(module.__file__, encoding="utf-8") as file:
            tree = ast.parse(file.read())
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("_"):
                body = node.body[1:] if ast.get_docstring(node) else node.body
                found.setdefault((node.name, ast.unparse(node.args)), set()).add("\n".join(map(ast.unparse, body)))
    assert [name for name, texts in found.items() if len(texts) > 1] == []

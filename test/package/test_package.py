# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The package's papers agree with each other and with the tree: manifest, setup, changelog, README, scripts."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock
from xml.etree import ElementTree

import pytest
from conftest import ROOT

OWN = ("adhesion_node", "sim_node")
ROS = re.compile(r"rclpy|ament_index_python|launch(_ros|_xml)?|.*_(msgs|srvs|interfaces)")
OPTIONAL = {"distributed": "cluster", "pyarrow": "parquet"}
"""Imported only where it is asked for: extra by module."""

BY_APT = {
    *("python3-numpy", "python3-scipy", "python3-yaml", "python3-matplotlib", "python3-argcomplete", "python3-aiohttp"),
    *("python3-numba", "python3-pyproj", "python3-pandas", "python3-hypothesis", "python3-pytest"),
}
BY_PIP = {"python3-rosbags-pip", "mcap-ros2-support"}
"""What the keys of rosdep/python.yaml install on Ubuntu 24.04; those by pip take a venv."""

FROM_PYPI = {  # import name: (distribution, rosdep key that brings it)
    "numpy": ("numpy", "python3-numpy"),
    "scipy": ("scipy", "python3-scipy"),
    "numba": ("numba", "python3-numba"),
    "matplotlib": ("matplotlib", "python3-matplotlib"),
    "argcomplete": ("argcomplete", "python3-argcomplete"),
    "pyproj": ("pyproj", "python3-pyproj"),
    "pandas": ("pandas", "python3-pandas"),
    "rosbags": ("rosbags", "python3-rosbags-pip"),
    "yaml": ("pyyaml", "python3-yaml"),
    "mcap": ("mcap", "mcap-ros2-support"),
    "lz4": ("lz4", "mcap-ros2-support"),
    "zstandard": ("zstandard", "mcap-ros2-support"),
    "aiohttp": ("aiohttp", "python3-aiohttp"),
}
PEERS = {"filterpy", "particles", "gtsam"}
"""What `bench` measures against: an extra, imported only by files of its own."""


@cache
def setup_arguments() -> dict[str, Any]:
    """Return what setup.py hands to setuptools, which a virtual environment need not have."""
    handed: dict[str, Any] = {}
    setuptools = SimpleNamespace(setup=handed.update, find_packages=lambda include: include)
    with mock.patch.dict(sys.modules, {"setuptools": setuptools}):
        runpy.run_path(str(ROOT / "setup.py"))
    return handed


def console_scripts() -> dict[str, tuple[str, str]]:
    """Return module and function of the console scripts by name."""
    entries = [
        re.fullmatch(r"(\w+) = ([\w.]+):(\w+)", entry) for entry in setup_arguments()["entry_points"]["console_scripts"]
    ]
    return {entry[1]: (entry[2], entry[3]) for entry in entries if entry}


@cache
def manifest() -> ElementTree.Element:
    return ElementTree.parse(ROOT / "package.xml").getroot()


@cache
def sources() -> list[Path]:
    return [path for package in OWN for path in (ROOT / package).rglob("*.py")]


@cache
def imported() -> set[str]:
    """Return the top-level packages that the sources import from elsewhere."""
    names: set[str] = set()
    for path in sources():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names.update(alias.name.partition(".")[0] for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
                names.add(node.module.partition(".")[0])
    return names - sys.stdlib_module_names - set(OWN)


def test_versions_agree() -> None:
    changelog = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    version = manifest().findtext("version")
    assert version == setup_arguments()["version"]
    newest, *released = re.findall(r"^(\S.*)\n-+$", changelog, re.MULTILINE)
    assert newest == "Forthcoming" or newest.partition(" ")[0] == version
    assert all(re.fullmatch(r"\d+\.\d+\.\d+ \(\d{4}-\d\d-\d\d\)", heading) for heading in released)


def test_a_release_can_be_prepared(tmp_path: Path) -> None:
    """By what `catkin_prepare_release` does of it, where that is installed."""
    packages, releases = (pytest.importorskip(f"catkin_pkg.{name}") for name in ("package", "package_version"))
    for name in ("package.xml", "setup.py"):
        shutil.copy(ROOT / name, tmp_path)
    releases.update_versions({str(tmp_path): packages.parse_package(str(tmp_path))}, "7.8.9")
    assert packages.parse_package(str(tmp_path)).version == "7.8.9"
    assert 'version="7.8.9",' in (tmp_path / "setup.py").read_text()
    changelog = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    assert releases.get_forthcoming_label(changelog) == "Forthcoming"


def test_the_manifest_names_somebody_and_a_place() -> None:
    maintainer = manifest().find("maintainer")
    assert maintainer is not None
    addresses = [maintainer.attrib["email"], *(str(url.text) for url in manifest().findall("url"))]
    assert len(addresses) > 1
    assert not [address for address in addresses if ".example" in address]
    licensed = manifest().find("license")
    assert licensed is not None
    assert (ROOT / licensed.attrib["file"]).is_file()


def test_contributions_come_under_the_license() -> None:
    """In its own words, as ament_copyright asks for."""
    license_, contributing = (
        " ".join((ROOT / name).read_text(encoding="utf-8").split()) for name in ("LICENSE", "doc/contributing.md")
    )
    clause = re.search(r"5\. Submission of Contributions\. .* regarding such Contributions\.", license_)
    assert clause is not None
    assert clause[0] in contributing


def test_the_ament_index_finds_the_package() -> None:
    installed = {(folder, file) for folder, files in setup_arguments()["data_files"] for file in files}
    name = manifest().findtext("name")
    assert ("share/ament_index/resource_index/packages", f"resource/{name}") in installed
    assert (f"share/{name}", "package.xml") in installed
    assert (f"share/{name}/config", "adhesion_node/nodes/defaults.yaml") in installed
    assert manifest().findtext("export/build_type") == "ament_python"


def test_every_file_of_bags_is_installed_in_its_folder() -> None:
    installed = {(Path(folder), Path(file)) for folder, files in setup_arguments()["data_files"] for file in files}
    recordings = [path.relative_to(ROOT) for path in (ROOT / "bags").rglob("*") if path.is_file()]
    assert recordings
    assert {(Path("share/adhesion_node") / path.parent, path) for path in recordings} <= installed
    assert not [path for _, path in installed if path.suffix == ".png"]


def test_every_source_folder_is_a_package() -> None:
    bare = {path.parent for path in sources() if not (path.parent / "__init__.py").is_file()}
    assert not bare, "setuptools leaves these folders out"


@pytest.mark.parametrize("name", sorted(console_scripts()))
def test_a_console_script_has_its_main(name: str) -> None:
    module, function = console_scripts()[name]
    parameters = inspect.signature(getattr(importlib.import_module(module), function)).parameters.values()
    assert all(parameter.default is None for parameter in parameters)


NODES = {"simulator", "slip_simulator", "estimator", "creep_estimator", "atp_monitor", "recorder", "replay", "live"}


@pytest.mark.parametrize("module", sorted({console_scripts()[name][0] for name in NODES}))
def test_a_node_imports_nothing_heavy_before_it_minds_signals(module: str) -> None:
    code = f"import sys, {module}; print({{name.partition('.')[0] for name in sys.modules}})"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not {name for name in ("numpy", "scipy", "rclpy", "matplotlib") if f"'{name}'" in loaded}


def test_the_executables_of_the_design_are_there() -> None:
    tools = {"recover", "import_csv", "train", "brakings", "demo", "report", "study", "bench"}
    assert set(console_scripts()) == NODES | tools


def depends(*kinds: str) -> set[str | None]:
    return {depend.text for kind in kinds for depend in manifest().findall(kind)}


def names_of(requirements: Iterable[str]) -> set[str]:
    return {re.split(r"[<>=~!\[]", requirement)[0] for requirement in requirements}


def test_what_is_imported_is_declared() -> None:
    ros_packages = {name for name in imported() if ROS.fullmatch(name)}
    assert ros_packages <= depends("exec_depend")
    extras = setup_arguments()["extras_require"]
    requirements = [*setup_arguments()["install_requires"], *extras["tools"], *extras["live"]]
    assert all(requirement.startswith(name) for name, extra in OPTIONAL.items() for requirement in extras[extra])
    for name in imported() - ros_packages - PEERS - OPTIONAL.keys():
        distribution, rosdep_key = FROM_PYPI[name]
        assert distribution in names_of(requirements)
        assert rosdep_key in depends("exec_depend", "test_depend")
    found = names_of(requirements)
    assert not any(ROS.fullmatch(name) for name in found), "ROS is no PyPI requirement; it stands in the extra `ros`"


def test_a_train_needs_ros_numpy_scipy_and_numba_alone() -> None:
    """YAML: what rclpy itself reads parameters with."""
    assert names_of(setup_arguments()["install_requires"]) == {"numpy", "scipy", "numba", "pyyaml"}
    keys = {name for name in depends("exec_depend") if not ROS.fullmatch(str(name))}
    assert keys == {"python3-numpy", "python3-scipy", "python3-numba", "python3-yaml"}
    extras = setup_arguments()["extras_require"]
    assert set(extras["tools"]) <= set(extras["test"])


def test_rosdep_knows_every_key_and_the_documentation_those_by_pip() -> None:
    assert {key for key in depends("exec_depend", "test_depend") if not ROS.fullmatch(str(key))} == BY_APT | BY_PIP
    assert {key for _, key in FROM_PYPI.values()} <= BY_APT | BY_PIP
    page = (ROOT / "doc" / "install.md").read_text(encoding="utf-8")
    skipped = re.search(r'^rosdep install .* --skip-keys "(.*)"$', page, re.MULTILINE)
    installed = re.search(r"^venv/bin/pip install '(rosbags.*)' '(mcap-ros2-support.*)'$", page, re.MULTILINE)
    assert skipped is not None
    assert installed is not None
    assert set(skipped[1].split()) == BY_PIP
    wanted = [*setup_arguments()["install_requires"], *setup_arguments()["extras_require"]["test"]]
    assert set(installed.groups()) <= set(wanted)


def test_only_bench_imports_its_peers() -> None:
    extra = {re.split(r"[<>=~!\[]", requirement)[0] for requirement in setup_arguments()["extras_require"]["bench"]}
    assert extra >= PEERS
    named = re.compile(rf"^\s*(from|import) ({'|'.join(PEERS)})\b", re.MULTILINE)
    importing = {path for path in sources() if named.search(path.read_text(encoding="utf-8"))}
    assert {path.name for path in importing} == {f"{peer}_smoother.py" for peer in PEERS}
    assert {path.parent.name for path in importing} == {"peers"}


HEAD = """\
# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.
"""
"""As `ament_copyright` knows it."""


def test_every_python_file_states_copyright_and_license() -> None:
    written = [path for folder in (*OWN, "test", "doc", "launch", ".ci") for path in (ROOT / folder).rglob("*.py")]
    assert len(written) > len(sources())
    texts = {path: path.read_text(encoding="utf-8") for path in (*written, ROOT / "setup.py")}
    bare = [str(path) for path, text in texts.items() if not re.match(rf"(#!.*\n)?{re.escape(HEAD)}", text)]
    assert not bare


REP_2004 = (
    *("1.i", "1.ii", "1.iii", "1.iv", "1.v", "1.vi", "2.i", "2.ii", "2.iii", "2.iv", "2.v"),
    *("3.i", "3.ii", "3.iii", "3.iv", "3.v", "3.v.a", "3.v.b", "3.v.c"),
    *("4.i", "4.ii", "4.iii.a", "4.iii.b", "4.iv.a", "4.iv.b", "4.v.a", "4.v.b", "5.i", "5.ii", "5.iii", "6.i", "7.i"),
)
"""Its points; the chart makes 3.iii and 3.iv a condition of Level 4."""


def test_the_quality_declaration_answers_every_point_of_rep_2004() -> None:
    declaration = (ROOT / "resource" / "QUALITY_DECLARATION.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| [*]{0,2}(\d\.[iva-c.]+) [^|]*\| ([^|]+) \|", declaration, re.MULTILINE)
    assert [point for point, _ in rows] == list(REP_2004)
    held = dict(rows)
    assert set(held.values()) <= {"yes", "in part", "no", "–"}
    assert "**Quality Level 4**" in declaration
    assert held["3.iii"] == held["3.iv"] == "yes"


def test_the_quick_start_is_two_commands() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    sections = re.findall(r"^## Quick start\n(.*?)(?=^## |\Z)", readme, re.MULTILINE | re.DOTALL)
    assert len(sections) == 1
    blocks = re.findall(r"^```sh\n(.*?)^```$", sections[0], re.MULTILINE | re.DOTALL)
    assert len(blocks) == 2
    for block, last in zip(blocks, ("demo", "python -m pytest -n auto"), strict=True):
        assert re.fullmatch(rf"python3 -m venv \.venv && .* && \.venv/bin/{last}\n", block), "not one command line"


def test_the_pages_name_the_same_pythons() -> None:
    readme, install = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "doc/install.md"))
    of_readme = re.search(r"^Needs git, python3 \((\S+) to (\S+)\) .* x86-64", readme, re.MULTILINE)
    of_install = re.search(r"x86-64, Python (\S+) to\s(\S+),", install)
    assert of_readme is not None
    assert of_install is not None
    assert of_readme.groups() == of_install.groups()
    assert setup_arguments()["python_requires"] == f">={of_readme[1]}"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The formulas: they take arrays as numpy does, and stand alone."""

import ast
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import numpy as np
import pytest

from sim_node.real import plant
from sim_node.real.plant.compiled import formula
from sim_node.real.plant.journey import Array

FILES = [Path(str(import_module(f"{plant.__name__}.{one.name}").__file__)) for one in iter_modules(plant.__path__)]


@formula("dd->dd")
def _both(one: float, other: float, total: Array, most: Array) -> None:
    total[0], most[0] = one + other, max(one, other)


def test_a_formula_takes_arrays_that_can_be_broadcast() -> None:
    one, other = np.arange(6.0).reshape(3, 2), np.array([[4.0], [0.0], [9.0]])
    total, most = _both(one, other)
    np.testing.assert_array_equal(total, one + other)
    np.testing.assert_array_equal(most, np.maximum(one, other))
    assert _both(1.0, 2.0) == (3.0, 2.0)


def test_nothing_of_a_formula_is_kept(tmp_path: Path) -> None:
    """Of two processes that compile one at once numba keeps parts that do not fit together: who loads them crashes."""
    called = "import numpy; from sim_node.real.plant.protection import command, start; rims = numpy.ones((1, 4))\n"
    called += "command(start(rims), rims)"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", called], check=True, env=environment, timeout=120.0)
    assert not [each for each in tmp_path.rglob("*") if each.is_file()]


@pytest.mark.parametrize("file", FILES, ids=[file.stem for file in FILES])
def test_a_formula_stands_alone(file: Path) -> None:
    """Nor takes the compiler's own exponential or arc tangent, which differ from numpy's by the last bit."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    constants = {
        name.id
        for node in tree.body
        if isinstance(node, ast.Assign)
        for name in ast.walk(node)
        if isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store)
    }
    formulas = [
        node
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and any(isinstance(one, ast.Call) and ast.unparse(one.func) == "formula" for one in node.decorator_list)
    ]
    for node in formulas:
        names = [name for statement in node.body for name in ast.walk(statement) if isinstance(name, ast.Name)]
        own = {name.id for name in names if isinstance(name.ctx, ast.Store)} | {one.arg for one in node.args.args}
        assert {name.id for name in names} <= own | constants | {"np", "min", "max", "abs"}, node.name
        assert not {"exp", "arctan", "log"} & {one.attr for one in ast.walk(node) if isinstance(one, ast.Attribute)}

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.
"""The command that mutates the core: the tests that it names are there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from conftest import ROOT

BODY = ast.parse((ROOT / ".ci" / "mutation.py").read_text(encoding="utf-8")).body
"""Read, not imported: it needs an extra."""

(TESTS,) = (each.value for each in BODY if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == "TESTS")


@pytest.mark.parametrize("uncompiled", [False, True])
def test_what_it_names_is_there(uncompiled: bool) -> None:
    given = eval(ast.unparse(TESTS))[uncompiled]
    paths = [ROOT / one for one in given if one.startswith(("test/", "adhesion_node/"))]
    assert paths
    assert [path for path in paths if not path.exists()] == []
    left_out = [one.partition("=*/")[2] for one in given if one.startswith("--ignore-glob")]
    files = [file for path in paths for file in (path.rglob("*.py") if path.is_dir() else (path,))]
    assert set(left_out) <= {file.name for file in files}
    named = re.findall(r"def (test_\w+)", "".join(map(Path.read_text, files)))
    parts = [part for one in given if one.startswith("not (") for part in one[5:-1].split(" or ")]
    assert bool(parts) == uncompiled
    assert [part for part in parts if not any(part in name for name in named)] == []

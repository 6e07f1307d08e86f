# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study remembered`: a map of earlier trains, and the safe curve with and without it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tasks import computed_here

from adhesion_node.study.__main__ import main
from adhesion_node.study.real import remembered


def test_rows_with_and_without_the_map(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(remembered, "PAIRS", (("metro_leaves", "metro_leaves"),))
    file = tmp_path / "remembered.json"
    options = ["--runs", "1", "--earlier", "3", "--cache", str(tmp_path / "cache")]
    with computed_here():
        assert main(["remembered", *options, "--json", str(file)]) == 0
    without, with_map = json.loads(file.read_text(encoding="utf-8"))
    assert (without["rail_map"], with_map["rail_map"]) == (False, True)
    assert (without["before"], without["now"], without["runs"]) == ("metro_leaves", "metro_leaves", 1)
    assert with_map["first_ratio"] != without["first_ratio"]
    assert with_map["least_ratio"] > 0.9
    assert "safe/true, first second" in capsys.readouterr().out


def test_no_runs_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["remembered", "--earlier", "0"]) == 2
    assert capsys.readouterr().err == "study: earlier = 0: give at least 1\n"

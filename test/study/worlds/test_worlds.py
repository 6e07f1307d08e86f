# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study worlds`: its lines, its confidences, what it counts, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tasks import computed_here

from adhesion_node.study.__main__ import main


def test_rows_by_sensors_and_confidence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "worlds.json"
    options = ["--runs", "1", "--first-seed", "7001", "--only", "speed+wheels", "--cache", str(tmp_path / "cache")]
    with computed_here():
        assert main(["worlds", *options, "--curve-confidence", "0.5,0.999", "--json", str(file)]) == 0
    half, surely = json.loads(file.read_text(encoding="utf-8"))
    assert (half["sensors"], half["runs"]) == ("speed+wheels", 1)
    assert (half["curve_confidence"], surely["curve_confidence"]) == (0.5, 0.999)
    assert half["excess_percent"] < surely["excess_percent"]
    assert half["bound_kept"] == surely["bound_kept"]
    assert half["safe_missed"] == (half["safe"] < 0.99)
    text = capsys.readouterr().out
    assert f"safe curves of 0.5: {100.0 * half['safe']:.2f} % are long enough" in text
    assert "safe curves of 0.999: " in text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--runs", "0"], "runs = 0: give at least 1"),
        (["--first-seed", "-1"], "first-seed = -1: give at least 0"),
        (["--only", "mars"], "only = mars: give parts of receiver; receiver+wheels; "),
        (["--curve-confidence", "0.99,2"], "curve_confidence = 2"),
        (["--curve-confidence", "0.99,"], "curve_confidence"),
        (["--set", "mars=1"], "setting 'mars=1': write NAME=VALUE"),
    ],
)
def test_what_cannot_be_is_refused(options: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["worlds", *options]) == 2
    told = capsys.readouterr().err
    assert told.startswith("study: ")
    assert message in told

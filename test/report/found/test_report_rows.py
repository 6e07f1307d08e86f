# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`report --out`: the estimates that it shows as rows of a file, as an offline replay writes them."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from slowing import START_NS, S, record, undrawn
from test_offline import NO_TRUTH, samples, write_run

from adhesion_node.nodes import replay
from adhesion_node.report.__main__ import main

__all__ = ["undrawn"]


@pytest.mark.usefixtures("undrawn")
def test_of_sensors_alone_the_rows_are_those_of_an_offline_replay(tmp_path: Path) -> None:
    bag, ours, theirs = str(tmp_path / "bag"), tmp_path / "report" / "ours.csv", tmp_path / "theirs.csv"
    write_run(tmp_path / "bag", samples(), names=NO_TRUTH)
    assert main([bag, "--output", str(tmp_path / "report"), "--out", str(ours)]) == 0
    assert replay.main([bag, "--offline", "--out", str(theirs)]) == 0
    assert len(ours.read_text().splitlines()) > 30
    assert ours.read_bytes() == theirs.read_bytes()


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(("options", "sign"), [((), 1), (("--set", "direction=down"), -1)])
def test_results_as_recorded_are_rows_with_what_was_recorded(
    options: tuple[str, ...], sign: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "results.csv"
    bag = str(record(tmp_path / "bag"))
    main([bag, "--output", str(tmp_path / "report"), "--out", str(out), *options])
    assert capsys.readouterr().out.endswith(f"{out}\n")
    with out.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["t_ns"]) for row in rows] == [START_NS + second * S for second in range(20)]
    assert [float(row["position_m"]) for row in rows] == [80.0 * second - second**2 for second in range(20)]
    assert {(row["mu"], row["mu_lower"], row["position_std_m"]) for row in rows} == {("0.09", "0.08", "1.0")}
    assert [row["regime"] for row in rows] == ["COASTING"] * 5 + ["ADHESION_LIMITED"] * 15
    assert {row["safe_m"] for row in rows} == {row["brake_factor"] for row in rows} == {""}, "was not recorded"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["mine", "mine", "--out", "results.csv"], "holds the estimates of one recording, 2 are given"),
        (["mine", "--out", "results.txt"], "give a file that ends in .csv or .parquet"),
        (["table.csv", "--out", "results.csv"], "are shown as written"),
    ],
)
def test_what_cannot_be_written_is_said_first(
    given: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    record(tmp_path / "mine")
    assert main([*given, "--output", "report"]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "report").exists()

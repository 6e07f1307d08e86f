# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The report: the page whole and without network, estimated where only sensors are."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

import pytest
from reported import Parser, lines, make
from slowing import TRUTH, record, undrawn
from test_offline import samples, write_run

from adhesion_node.nodes import replay
from adhesion_node.report.__main__ import main

__all__ = ["undrawn"]

QUICK = ("--set", "estimate_s=1.0")


def test_a_name_of_bytes_that_are_no_text_is_escaped(tmp_path: Path) -> None:
    named = tmp_path / os.fsdecode(b"t\xff")
    write_run(named, samples(15.0, 30.0))
    result, page = make(tmp_path, str(named))
    assert result["runs"][0]["name"] == "t\\udcff"
    assert "t\\udcff" in " ".join(page.texts)


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any], Parser]:
    """The report of a recording with results: its folder, the JSON and the page."""
    folder = tmp_path_factory.mktemp("shown")
    return folder / "report", *make(folder, str(record(folder / "mine")))


def test_a_recording_with_results_is_shown_as_recorded(shown: tuple[Path, dict[str, Any], Parser]) -> None:
    folder, result, page = shown
    (run,) = page.data["runs"]
    assert (run["name"], run["source"], result["runs"][0]["source"]) == ("mine", "as recorded", "as recorded")
    adhesion, speed, forces = (lines(run, title) for title in ("Adhesion", "Speed", "Forces"))
    assert adhesion["identified"]["x"] == list(range(20))
    assert adhesion["identified"]["y"] == [None] * 5 + [0.09] * 15
    assert adhesion["known, nothing claimed"]["y"] == [0.09] * 5 + [None] * 15
    assert [set(adhesion[name]["y"]) for name in ("lower bound", "true")] == [{0.08}, {0.1}]
    assert speed["estimated"]["y"] == pytest.approx([3.6 * (80.0 - 2.0 * second) for second in range(20)], abs=0.006)
    assert forces["brake B"]["y"] == pytest.approx([500.2] * 20, abs=0.05)  # 0.9332 m/s^2 x 536 t
    assert forces["adhesion F, identified"]["y"][5:] == pytest.approx([0.09 * 536 * 9.8] * 15, abs=0.05)
    assert len(run["moments"]) == 20
    for name in ("mine.png", "mine.pdf"):
        assert (folder / name).stat().st_size > 10_000
    assert (folder / "mine.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.usefixtures("undrawn")
def test_of_sensors_alone_the_results_are_those_of_an_offline_replay(tmp_path: Path) -> None:
    write_run(tmp_path / "bag", samples())
    _, page = make(tmp_path, str(tmp_path / "bag"), *QUICK)
    assert replay.main([str(tmp_path / "bag"), "--offline", *QUICK, "--json", str(tmp_path / "replay.json")]) == 0
    replayed = json.loads((tmp_path / "replay.json").read_text())
    (run,) = page.data["runs"]
    assert run["source"] == "estimated from the recorded sensors"
    assert replayed["digest"] in page.texts
    adhesion = lines(run, "Adhesion")
    kinds = {"ADHESION_LIMITED": "identified", "BRAKE_LIMITED": "at least, the brake limits"}
    said = adhesion[kinds.get(replayed["regime_final"], "known, nothing claimed")]
    assert said["y"][-1] == pytest.approx(replayed["mu_final"], abs=1e-5)
    (bound,) = (line["y"][-1] for label, line in adhesion.items() if label.startswith("lower bound, "))
    assert bound == pytest.approx(replayed["mu_lower_final"], abs=1e-5)
    assert run["bands"][-1]["kind"] == replayed["regime_final"].lower()
    assert "estimate_s = 1.0" in page.texts
    last = run["moments"][-1]
    assert last["safe"]["x"][0] == last["nominal"]["x"][0] == pytest.approx(last["place"], abs=0.1)
    assert last["safe"]["y"][-1] == 0.0


def test_results_are_estimated_anew_on_demand(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = record(tmp_path / "mine")  # without positions: as recorded it can be shown
    report = tmp_path / "new" / "report"
    assert main([str(bag), "--output", str(report), "--estimate", "--out", str(report / "rows.csv")]) == 2
    assert "topic position: not in the recording" in capsys.readouterr().err
    assert not report.parent.exists(), "an empty folder was left"


def test_the_page_fetches_nothing(shown: tuple[Path, dict[str, Any], Parser]) -> None:
    folder, _, page = shown
    assert page.fetched == []
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert set(re.findall(r"https?://[^\s\"']+", html)) == {"http://www.w3.org/2000/svg"}
    assert "default-src 'none'" in html
    assert '<link rel="icon" href="data:,">' in html, "else a browser asks the server for a picture, in vain"
    assert "img-src data:" in html
    assert not re.search(r"@import|url\((?!#)", html)


def test_recordings_stand_side_by_side_under_their_own_names(tmp_path: Path) -> None:
    first, second = record(tmp_path / "one" / "bag"), record(tmp_path / "two" / "bag", *TRUTH)
    result, page = make(tmp_path, str(first), str(second), "--target", "180")
    assert [run["name"] for run in page.data["runs"]] == [run["name"] for run in result["runs"]] == ["bag", "bag (2)"]
    assert ["true" in lines(run, "Adhesion") for run in page.data["runs"]] == [True, False]
    assert page.data["target_kmh"] == 180.0
    assert all(Path(path).is_file() for run in result["runs"] for path in run["pictures"])


@pytest.mark.usefixtures("undrawn")
def test_the_only_train_of_a_recording_is_shown_whatever_its_namespace(tmp_path: Path) -> None:
    without, _ = make(tmp_path, str(record(tmp_path / "bag")))
    within, page = make(tmp_path, str(record(tmp_path / "other" / "bag", namespaces=["/line1/train7"])))
    assert within == without
    assert lines(page.data["runs"][0], "Adhesion")["identified"]["y"] == [None] * 5 + [0.09] * 15


@pytest.mark.usefixtures("undrawn")
def test_of_several_trains_one_is_to_be_chosen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    both = str(record(tmp_path / "both", namespaces=["/train2", "/train1"]))
    assert main([both, "--output", str(tmp_path / "report")]) == 2
    assert capsys.readouterr().err == (
        f"report: bag = {both}: holds the trains /train1, /train2: choose one, --namespace /train1\n"
    )
    assert main([both, "--output", str(tmp_path / "report"), "--namespace", "/train3"]) == 2
    remedy = f"namespace = /train3: not in the recording {both}: choose of /train1, /train2"
    assert remedy in capsys.readouterr().err
    result, _ = make(tmp_path, both, "--namespace", "train2")
    assert result["runs"][0]["source"] == "as recorded"


@pytest.mark.usefixtures("undrawn")
def test_a_setting_that_counts_for_a_recording_with_results_is_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result, _ = make(tmp_path, str(record(tmp_path / "bag")), "--set", "train.mass_kg=400000")
    assert "400 t" in result["train"]
    (tmp_path / "my.yaml").write_text("estimator: {ros__parameters: {start_mu: 0.3, train.mass_kg: 4.0e+5}}\n")
    again, _ = make(tmp_path, str(tmp_path / "bag"), "--params", str(tmp_path / "my.yaml"))
    assert again == result
    assert "only the train, direction and ambient_pressure_pa count; --estimate heeds all" in capsys.readouterr().err


def test_a_name_cannot_break_the_page(tmp_path: Path) -> None:
    _, page = make(tmp_path, str(record(tmp_path / "<b>&amp;<script>")))
    assert page.data["runs"][0]["name"] == "<b>&amp;<script>"
    assert "<b>&amp;<script>" in page.texts

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study distances`: the published braking distances and times, as a table and as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from adhesion_node.study.__main__ import main
from adhesion_node.study.xie import distances, figures
from adhesion_node.study.xie.published import SAVINGS

PUBLISHED = {
    (300, 100, "0.1542"): (3060.7, 56.1),
    (300, 100, "0.0726"): (3946.7, 71.7),
    (300, 100, "wet law"): (3481.1, 62.8),
    (250, 50, "0.1542"): (2404.3, 59.3),
    (250, 50, "0.0726"): (2958.9, 72.7),
    (250, 50, "wet law"): (2614.4, 62.7),
}
"""Distance in m and time in s by speeds in km/h and adhesion, as printed in the paper."""


def integrated(from_kmh: float, to_kmh: float, case: str) -> tuple[float, float]:
    """Distance and time by small steps of time, with the constants of the paper written out."""
    speed, distance, time, step = from_kmh / 3.6, 0.0, 0.0, 1e-3
    while speed > to_kmh / 3.6:
        kmh = 3.6 * speed
        mu = 0.04 + 13.7 / (120.0 + kmh) if case == "wet law" else float(case)
        resistance = (0.79 + 0.0064 * kmh + 0.000115 * kmh**2) / 1000.0
        slower = speed - step * 9.8 * (min(mu, 0.9332 / 9.8) + resistance)
        distance += step * (speed + slower) / 2.0
        speed, time = slower, time + step
    return distance, time


def test_distances_as_json_stand_alone_and_near_the_paper(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["distances", "--json", "-"]) == 0
    table = json.loads(capsys.readouterr().out)
    assert {(row["from_kmh"], row["to_kmh"], row["case"]) for row in table} == set(PUBLISHED)
    assert len(table) == 6
    for row in table:
        assert {"from_kmh", "to_kmh", "case", "distance_m", "time_s", "paper_distance_m", "paper_time_s"} <= set(row)
        paper = PUBLISHED[row["from_kmh"], row["to_kmh"], row["case"]]
        assert (row["paper_distance_m"], row["paper_time_s"]) == paper
        assert row["distance_m"] == pytest.approx(paper[0], rel=0.045)
        assert row["time_s"] == pytest.approx(paper[1], rel=0.045)
        assert row["distance_deviation_percent"] == pytest.approx(100 * (row["distance_m"] - paper[0]) / paper[0])
        assert row["time_deviation_percent"] == pytest.approx(100 * (row["time_s"] - paper[1]) / paper[1])


def test_distances_are_those_of_a_plain_integration(capsys: pytest.CaptureFixture[str]) -> None:
    main(["distances", "--json", "-"])
    for row in json.loads(capsys.readouterr().out):
        distance, time = integrated(row["from_kmh"], row["to_kmh"], row["case"])
        assert row["distance_m"] == pytest.approx(distance, rel=1e-3)
        assert row["time_s"] == pytest.approx(time, rel=1e-3)


def test_the_table_is_for_people_and_the_file_for_programs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["distances", "--json", str(tmp_path / "d.json")]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = json.loads((tmp_path / "d.json").read_text())
    for line, row in zip(lines[1:7], rows, strict=True):
        assert f"{row['distance_m']:.1f}" in line
        assert f"{row['paper_distance_m']:.1f}" in line
    assert main(["distances"]) == 0
    assert capsys.readouterr().out.splitlines() == lines


def test_the_savings_are_those_of_the_rows(capsys: pytest.CaptureFixture[str]) -> None:
    """Of the wet law against the fixed worst case, each beside the paper's headline."""
    main(["distances"])
    shown = [line.split() for line in capsys.readouterr().out.splitlines()[-2:]]
    main(["distances", "--json", "-"])
    rows = {(row["from_kmh"], row["case"]): row for row in json.loads(capsys.readouterr().out)}
    for cells, (start, paper) in zip(shown, ((300, ("11.80", "12.41")), (250, ("11.64", "13.76"))), strict=True):
        wet, worst = rows[start, "wet law"], rows[start, "0.0726"]
        ours = [f"{100 - 100 * wet[name] / worst[name]:.2f}" for name in ("distance_m", "time_s")]
        assert cells[3:] == [ours[0], paper[0], ours[1], paper[1]]


def test_the_figures_of_the_brakings(tmp_path: Path) -> None:
    begin = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}
    for form, magic in begin.items():
        assert main(["distances", "--figures", str(tmp_path / "new" / form), "--format", form]) == 0
        files = sorted(tmp_path.glob(f"new/{form}/*.{form}"))
        assert [int(file.name[3:5]) for file in files] == [2, 3, 10, 11, 12, 13, 20, 21]
        assert all(file.stat().st_size > 5_000 and file.read_bytes().startswith(magic) for file in files)


def test_savings_beside_the_papers() -> None:
    found = list(distances.savings(list(distances.rows())))
    assert [(row["from_kmh"], row["to_kmh"]) for row in found] == [(300, 100), (250, 50)]
    for row in found:
        assert row["distance_percent"] == pytest.approx(row["paper_distance_percent"], abs=4.0)
        assert row["time_percent"] == pytest.approx(row["paper_time_percent"], abs=4.0)
    printed = [100 * (1 - 3481.1 / 3946.7), 100 * (1 - 2614.4 / 2958.9)]
    assert printed == pytest.approx([saving.distance_percent for saving in SAVINGS], abs=0.01)


@pytest.mark.parametrize("scene", figures.SCENES)
def test_the_rail_drops_as_the_paper_says(scene: figures.Scene) -> None:
    speeds, adhesion = figures.rail(scene)
    assert (speeds[0], speeds[1], speeds[-1]) == (scene.from_kmh, scene.from_kmh, scene.to_kmh)
    printed = {300: [0.1432, 0.0726, 0.1023], 250: [0.1514, 0.0770, 0.1206]}
    assert adhesion[[0, 1, -1]] == pytest.approx(printed[round(scene.from_kmh)], abs=6e-5)


@pytest.mark.parametrize("args", [["--help"], ["distances", "--help"]])
def test_help_is_shown(args: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(args)
    assert ended.value.code == 0
    assert "distances" in capsys.readouterr().out


@pytest.mark.parametrize("args", [[], ["speeds"], ["distances", "--nothing"], ["distances", "--json"]])
def test_bad_usage_ends_with_code_2(args: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(args)
    assert ended.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "study" in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--workers", "2"], "--workers 2: is for --runs: add that, or leave this out"),
        (["--cache", "here"], "--cache here: is for --runs: add that, or leave this out"),
        (["--format", "png"], "--format png: nothing is drawn without --figures: add that, or leave this out"),
    ],
)
def test_an_option_without_effect_is_refused(options: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["distances", *options]) == 2
    assert capsys.readouterr() == ("", f"study: {said}\n")


@pytest.mark.parametrize(
    "study", ["tables", "creep", "robust", "bound", "intervention", "real"], ids=lambda name: f"study {name}"
)
def test_how_figures_look_is_refused_before_anything_is_computed(
    study: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([study, "--width", "85"]) == 2
    assert capsys.readouterr().err.startswith("study: --width 85: nothing is drawn without --figures")


def test_a_file_that_cannot_be_written_is_one_line_and_code_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["distances", "--json", str(tmp_path / "nowhere" / "d.json")]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("study: ")
    assert "d.json" in line

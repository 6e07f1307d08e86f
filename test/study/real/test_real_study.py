# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study real`: its cases, its text, the JSON and the pictures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tasks import computed_here

from adhesion_node.command.running import Running
from adhesion_node.core.physics.train import GRAVITY
from adhesion_node.study.__main__ import main
from adhesion_node.study.real import point_mass
from adhesion_node.study.real.cases import CASES, Case, chosen
from adhesion_node.study.real.trials import arrays, found
from adhesion_node.study.real.truth import truth_at
from sim_node.real.plant.scenarios import SCENARIOS
from sim_node.real.sensors.fitted import FITTED


def test_cases_are_chosen_by_parts_of_their_names() -> None:
    assert [case.name for case in chosen("POINT, one_cylinder")] == [
        case.name for case in CASES if "point" in case.name or "one_cylinder" in case.name
    ]
    assert chosen("") == CASES
    with pytest.raises(ValueError, match=r"only = mars: give parts of .*point_mass"):
        chosen("mars")


def test_a_setting_may_be_told_otherwise() -> None:
    for case in chosen("point, tram_wet", ["profile_std=1e-5", "confidence=0.9"]):
        assert (case.config.profile_std, case.config.confidence) == (1e-5, 0.9)
        assert case.config.train == case._replace(told=()).config.train
    with pytest.raises(ValueError, match=r"setting 'mars=1': write NAME=VALUE"):
        chosen("", ["mars=1"])
    with pytest.raises(ValueError, match=r"confidence = 2\.0"):
        _ = chosen("point", ["confidence=2"])[0].config


def test_the_cases_span_trains_rails_and_sensors() -> None:
    scenarios = {case.scenario for case in CASES}
    assert scenarios <= {*SCENARIOS, point_mass.NAME}
    assert {case.fitted for case in CASES} <= {*FITTED}
    trains = {SCENARIOS[name].nominal.name for name in scenarios - {point_mass.NAME}}
    assert trains == {scenario.nominal.name for scenario in SCENARIOS.values()}


def test_the_estimator_is_told_the_papers_and_not_the_truth() -> None:
    for case in CASES[1:]:
        nominal, config = SCENARIOS[case.scenario].nominal, case.config
        brake = config.train.brake_force(nominal.full_pa)
        assert brake == pytest.approx(nominal.brake_n)
        assert config.train.mass_kg == nominal.mass_kg
        c0, c1, c2 = nominal.resistance
        resisting = config.train.specific_resistance(20.0) * nominal.mass_kg * GRAVITY
        assert resisting == pytest.approx(c0 + c1 * 20.0 + c2 * 400.0)
        assert case.built_after_s > nominal.build_up_s


def test_the_point_mass_slides_all_the_way_to_its_standstill() -> None:
    (drive,) = point_mass.drives([7])
    journey = drive.journey
    assert journey.speed_mps[-1] == 0.0
    braked = (journey.time_s > journey.full_from_s + 0.1) & (journey.speed_mps > 0.1)
    assert np.all(truth_at(journey, journey.time_s).slid[braked] == 1.0)
    assert journey.used[braked] == pytest.approx(0.07)
    assert [at_s for at_s, _ in drive.messages] == sorted(at_s for at_s, _ in drive.messages)


def test_positions_of_an_axle_that_slides_are_left_out_before_they_mislead() -> None:
    """This one slides so little, and by turns, that no deceleration of it is impossible."""
    case = Case("wet", "tacho")
    (drive,) = case.drives([5001])
    parts = arrays(drive, case.config, case.built_after_s)
    rows, (run,) = parts["rows"], parts["runs"]
    rows = rows[(rows["t_s"] >= run["built_s"]) & (rows["t_s"] < run["slow_s"])]
    assert np.mean(rows["withheld"]) > 0.9
    assert np.all(rows["safe_m"] + 5.0 >= rows["remaining_m"])
    assert np.all(rows["lower"] <= rows["used"])


def test_rows_and_pictures_of_a_case(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, figures = tmp_path / "real.json", tmp_path / "figures"
    options = ["--runs", "1", "--only", "tram_leaves", "--cache", str(tmp_path / "cache")]
    with computed_here():
        assert main(["real", *options, "--tune", "--json", str(file), "--figures", str(figures)]) == 0
    (row,) = json.loads(file.read_text())
    assert (row["case"], row["scenario"], row["first_seed"], row["runs"]) == (
        "tram_leaves gnss_wheels",
        "tram_leaves",
        5000,
        1,
    )
    assert row["limited"] > 0.9
    assert set(row["missed"]) <= set(row)
    assert sorted(path.name for path in figures.iterdir()) == [
        "all_bound.png",
        "all_error.png",
        "tram_leaves-gnss_wheels.png",
    ]
    text = capsys.readouterr().out
    assert "every goal is met in" in text
    assert ("!" in text) == bool(row["missed"])
    again = found(chosen("tram_leaves"), 5000, 1, Running(tmp_path / "cache"))
    assert len(list((tmp_path / "cache").glob("real-*"))) == 1
    assert len(again) == 1


def test_no_runs_no_seeds_and_no_cases_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["real", "--runs", "0", "--cache", str(tmp_path)]) == 2
    assert capsys.readouterr().err == "study: runs = 0: give at least 1\n"
    assert main(["real", "--first-seed", "-1", "--cache", str(tmp_path)]) == 2
    assert capsys.readouterr().err == "study: first-seed = -1: give at least 0\n"
    assert main(["real", "--first-seed", "99999999999999999999", "--cache", str(tmp_path)]) == 2
    assert capsys.readouterr().err == "study: first-seed = 99999999999999999999: give at most 2147483647\n"
    assert main(["real", "--only", "nowhere", "--cache", str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("study: only = nowhere: give parts of ")

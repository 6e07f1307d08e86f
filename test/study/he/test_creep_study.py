# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study creep`: the paper's claims as this project states them, the JSON, the figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import made_once
from tasks import computed_here

from adhesion_node.command import engines
from adhesion_node.study.__main__ import main
from adhesion_node.study.he import figures as creep_models
from adhesion_node.study.he import runs as creep_runs
from adhesion_node.study.he import study as creep

KEYS = {"experiment", "peak_true", "peak_estimated_mean", "peak_estimated_std", "used_fraction"}


def make_study(folder: Path) -> None:
    files = ["--json", str(folder / "creep.json"), "--figures", str(folder / "figures")]
    with computed_here():
        assert main(["creep", *files, "--cache", str(folder / "cache")]) == 0


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[Any, dict[str, Any]]]:
    """The study with 20 seeds, once: the folder of its figures and its rows by experiment."""
    folder = made_once(tmp_path_factory, "creep_study", make_study)
    rows = json.loads((folder / "creep.json").read_text(encoding="utf-8"))
    return folder / "figures", {row["experiment"]: row for row in rows}


def test_every_row_has_the_agreed_keys(study: tuple[Path, dict[Any, dict[str, Any]]]) -> None:
    assert all(set(row) >= KEYS for row in study[1].values())
    assert {1, 2, 3} <= set(study[1])


def test_the_peak_is_predicted_from_creeps_up_to_0_03(study: tuple[Path, dict[Any, dict[str, Any]]]) -> None:
    row = study[1][1]
    assert row["creep_used"] == 0.03
    assert row["peak_estimated_mean"] == pytest.approx(row["peak_true"], rel=0.05)
    assert row["dfp_difference"] < 1e-6


def test_the_new_surface_is_known_within_half_of_its_data(study: tuple[Path, dict[Any, dict[str, Any]]]) -> None:
    assert study[1][2]["used_fraction"] <= 0.5


def test_the_varying_factor_is_earlier_by_a_tenth_and_quieter(study: tuple[Path, dict[Any, dict[str, Any]]]) -> None:
    fixed, varying = study[1][2], study[1][3]
    assert varying["used_fraction"] <= fixed["used_fraction"] - 0.1
    assert varying["std_before_switch"] < 0.5 * fixed["std_before_switch"]


def test_it_is_told_that_a_single_rise_shows_the_contrary(study: tuple[Path, dict[Any, dict[str, Any]]]) -> None:
    rows = study[1]
    assert rows["3, single rise"]["used_fraction"] > rows["2, single rise"]["used_fraction"]


def test_noise_on_the_creep_biases_the_plain_fit_alone(study: tuple[Path, dict[Any, dict[str, Any]]]) -> None:
    bias = {name: row["bias_percent"] for name, row in study[1].items() if "bias_percent" in row}
    assert bias["creep noise 0.001, least squares"] < -5.0
    assert abs(bias["creep noise 0.001, compensated least squares"]) < 2.0
    assert abs(bias["creep noise 0.001, errors in variables"]) < 2.0


def test_intervals_cover_and_wrong_peaks_are_withheld(study: tuple[Path, dict[Any, dict[str, Any]]]) -> None:
    row = study[1][1]
    assert all(0.90 < share < 0.985 for share in row["coverage95"].values())
    for step in row["withholding"]:
        assert step["published"] * step["wrong_of_published"] < 0.02
    assert row["withholding"][-1]["published"] == 1.0


def test_every_figure_is_drawn(study: tuple[Path, dict[Any, dict[str, Any]]]) -> None:
    assert sorted(path.name for path in study[0].iterdir()) == [
        f"fig{number:02d}.png" for number in (1, 2, 3, *range(5, 12))
    ]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in study[0].iterdir())


def test_kienckes_curve_comes_near_burckhardts_model() -> None:
    """The paper: peaks less than 2 % apart. Near the fit no other p1, p2 is nearer."""
    theta, truth = creep_models.like(creep_models.DRY_ROAD), creep_models.DRY_ROAD(creep_models.CREEPS)

    def distance(theta: np.ndarray) -> float:
        slope, (p1, p2), creeps = creep_models.DRY_ROAD.slope, theta, creep_models.CREEPS
        return float(np.sum((slope * creeps / (1.0 + p1 * creeps + p2 * creeps**2) - truth) ** 2))

    others = [theta + 0.1 * step for step in (*np.eye(2), *-np.eye(2))]
    assert distance(theta) < min(map(distance, others))
    peak = creep_models.DRY_ROAD.slope / (theta[0] + 2.0 * theta[1] ** 0.5)
    assert peak == pytest.approx(truth.max(), rel=0.02)


def test_the_sensitivity_tells_samples_and_gains(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every row by its name; a larger gain is earlier on a single rise."""
    monkeypatch.setattr(creep, "SCAN_SWINGS", (50,))
    monkeypatch.setattr(creep, "SCAN_RAMPS", (100,))
    monkeypatch.setattr(creep, "RAMP", 2000)
    wanted = creep.sensitivity(2, 1)
    rows = {name: creep.row_of(name, task, task.compute()["theta"]) for name, task in wanted.items()}
    names = [f"{number}, {what}" for what in ("50 samples per rise", "single rise of 100") for number in (2, 3)]
    assert list(rows) == [*names, "3, single rise, K_p 0.3", "3, single rise, K_p 1"]
    assert rows[names[0]]["samples"] == 300
    assert rows["3, single rise, K_p 1"]["used_fraction"] < rows["3, single rise, K_p 0.3"]["used_fraction"]


def test_the_same_study_again_computes_nothing(
    study: tuple[Path, dict[Any, dict[str, Any]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(engines, "processes")
    assert main(["creep", "--json", str(tmp_path / "again.json"), "--cache", str(study[0].parent / "cache")]) == 0
    assert json.loads((tmp_path / "again.json").read_text()) == list(study[1].values())


def test_a_run_does_not_depend_on_how_many_there_are() -> None:
    few, many = (creep_runs.Experiment(runs, 7).compute()["theta"][-1] for runs in (2, 5))
    assert np.array_equal(few, many[:2])


def test_bad_numbers_are_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["creep", "--runs", "1"]) == 2
    assert capsys.readouterr().err == "study: runs = 1: give at least 2\n"
    assert main(["creep", "--seed", "-1"]) == 2
    assert capsys.readouterr().err == "study: seed = -1: give at least 0\n"

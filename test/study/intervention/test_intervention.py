# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The study of intervention distances: its cases, its limits, and what it says without a braking curve."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from adhesion_node.core.physics import braking
from adhesion_node.core.physics.adhesion import WET
from adhesion_node.core.physics.train import CRH3, KMH
from adhesion_node.core.prediction import Prediction
from adhesion_node.report.read.predicted import Curves
from adhesion_node.report.read.run import Run
from adhesion_node.report.read.series import Series
from adhesion_node.study.__main__ import main
from adhesion_node.study.intervention import study as intervention
from adhesion_node.study.intervention.figure import draw_changing
from adhesion_node.study.trial.figures import Place


def prediction(speed_kmh: float, mu: float, mu_lower: float) -> Prediction:
    sure = {"position_std_m": 1.0, "speed_std_mps": 0.1}
    estimate: Any = SimpleNamespace(speed_mps=speed_kmh * KMH, mu=mu, mu_lower=mu_lower, **sure)
    safe, nominal = (braking.curve(CRH3, speed_kmh * KMH, value) if value else None for value in (mu_lower, mu))
    return Prediction(estimate, safe, nominal)


SAID = [prediction(290, 0.060, 0.0), prediction(256, 0.070, 0.060), prediction(249, 0.075, 0.070)]


def by_case(speed_kmh: int, said: list[Prediction] = SAID, kwet: float = 0.8) -> dict[str, dict[str, Any]]:
    found = intervention.rows("tunnel_entry", said, kwet)
    return {row["case"]: row for row in found if row["speed_kmh"] == speed_kmh}


def needed(speed_kmh: float, mu: Any) -> float:
    """EBI, m, by hand: 1.5 s of build-up at up to 0.4 m/s^2, 107.5 km/h at the target.

    The train is 0.5 m/s and three standard deviations faster than told, and 5 m and three further ahead.
    """
    speed = speed_kmh * KMH + 0.8
    length = float(braking.curve(CRH3, speed + 0.6, mu, 107.5 * KMH).distance_m[-1])
    return length + (speed + 0.3) * 1.5 + 8.0


def test_each_case_brakes_by_its_own_adhesion() -> None:
    found = by_case(250)
    adhesion = {"true wet law": WET, "mu": 0.070, "mu_lower": 0.060, "fixed 0.0726": 0.0726}
    # 0.8 of the full brake's 0.9332 m/s^2, and 0.7 m/s^2, over g.
    adhesion |= {"K_wet 0.8": 0.8 * 0.9332 / 9.8, "slippery 0.7": 0.7 / 9.8}
    assert list(found) == list(adhesion)
    for case, mu in adhesion.items():
        # Beyond its first point a curve is continued at its weakest deceleration: some metres on the safe side.
        assert -0.5 < found[case]["ebi_m"] - needed(250, mu) < 20.0, case


def test_the_estimate_is_the_last_one_whose_curve_begins_above_the_speed() -> None:
    assert by_case(250)["mu"]["mu"] == 0.070
    assert by_case(200)["mu"]["mu"] == 0.075


def test_without_a_curve_or_an_estimate_the_distances_are_unknown() -> None:
    assert by_case(280)["mu_lower"]["ebi_m"] is None
    assert by_case(280, said=[])["mu"] == {
        "scenario": "tunnel_entry",
        "speed_kmh": 280,
        "target_kmh": 100.0,
        "case": "mu",
        "mu": None,
        **dict.fromkeys(("ebi_m", "sbi_m", "warning_m", "permitted_m", "indication_m")),
    }


def test_the_command_prints_the_table_and_writes_json(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(intervention, "predictions", lambda bag, seed: SAID)
    options = ["--json", str(tmp_path / "table.json"), "--figures", str(tmp_path / "figures")]
    assert main(["intervention", *options]) == 0
    table = json.loads((tmp_path / "table.json").read_text())
    assert len(table) == 2 * 4 * 6
    for row in table:
        if row["ebi_m"] is not None:
            assert row["ebi_m"] < row["sbi_m"] < row["warning_m"] < row["permitted_m"] < row["indication_m"]
    assert imread(tmp_path / "figures" / "supervision.png").shape[:2] == (800, 1338)
    out, err = capsys.readouterr()
    printed = out.splitlines()
    assert f"written: {tmp_path / 'figures' / 'supervision.png'}" in err.splitlines()
    assert len(printed) == 2 * (2 + 4)
    assert printed[2].split()[3] == "no"  # curve
    # 280 km/h and 0.3 m/s: T_bs = 2 s, T_warning = 2 s, T_driver = 4 s, T_indication = 9 s
    assert printed[2].split()[-4:] == ["156", "312", "468", "1171"]


def test_without_a_curve_there_is_no_figure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(intervention, "predictions", lambda bag, seed: SAID[:1])
    assert main(["intervention", "--figures", str(tmp_path)]) == 2
    assert "there is no braking curve at 200 km/h" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--kwet", "0"], "kwet = 0.0: give a factor above 0"),
        (["--bags", "nowhere"], "nowhere"),
        (["--seed", "-1"], "study: seed = -1: give at least 0"),
    ],
)
def test_bad_input_is_one_line_and_code_2(options: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["intervention", *options]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line


BRAKED_M, LEAVES_M, STOPS_M = 400.0, 800.0, 1800.0
DRY_MPS2, LEAVES_MPS2 = 1.0, 0.4


def braked_onto_leaves() -> Run:
    """A run at constant decelerations, and what was known of it: nothing, then 0.9 of what there is."""
    place = np.arange(0.0, STOPS_M + 5.0, 5.0)
    on_leaves = np.maximum(STOPS_M - np.maximum(place, LEAVES_M), 0.0)
    on_dry = np.maximum(LEAVES_M - np.maximum(place, BRAKED_M), 0.0)
    speed = np.sqrt(2.0 * (LEAVES_MPS2 * on_leaves + DRY_MPS2 * on_dry))
    given = np.where(place < BRAKED_M, 0.2, np.where(place < LEAVES_M, DRY_MPS2, LEAVES_MPS2))
    times = (place * 1e9).astype(np.int64)
    curves = Curves()
    for t_ns, at_m, from_mps, mps2 in zip(times[::10], place[::10], speed[::10], 0.9 * given[::10], strict=True):
        speeds = np.linspace(from_mps, 0.0, 50)
        places = at_m + (from_mps**2 - speeds**2) / (2.0 * mps2)
        curves.add(np.array([t_ns]), places[np.newaxis], speeds[np.newaxis])
    ways, speeds_of_it, adhesion = (Series(times, values) for values in (place, speed, given / 9.8))
    truth = Run(true_position=ways, true_speed=speeds_of_it, true_mu=adhesion, position=ways, speed=speeds_of_it)
    regime = Series(times, np.where(place < BRAKED_M, "COASTING", "ADHESION_LIMITED"))
    bound = adhesion.map(lambda mu: 0.9 * mu)
    return truth._replace(mu=adhesion, mu_lower=bound, safe=curves, regime=regime)


def test_the_picture_says_how_far_the_limits_are_off_on_leaves(tmp_path: Path) -> None:
    draw_changing(braked_onto_leaves(), LEAVES_M, Place(tmp_path / "changing.svg"))
    drawn = (tmp_path / "changing.svg").read_text(encoding="utf-8")
    true, fixed, known = (3.6 * np.sqrt(2.0 * mps2 * 700.0) for mps2 in (LEAVES_MPS2, 0.0726 * 9.8, 0.9 * LEAVES_MPS2))
    assert f"{fixed - true:.0f} km/h too fast" in drawn
    assert f"{true - known:.0f} km/h below what the rail allows" in drawn
    assert all(text in drawn for text in ("dry rail", "leaves", "before the brake nothing is known"))

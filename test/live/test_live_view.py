# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the live page is told: units, health of the inputs, limits; all of it fit for JSON."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from told_view import STATUS, S, estimate

from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.atp.supervision import read
from adhesion_node.core.physics.braking import BrakingCurve, curve
from adhesion_node.core.physics.train import CRH3
from adhesion_node.live.feed import Feed
from adhesion_node.live.inputs import EXPECTED
from adhesion_node.live.view import View
from adhesion_node.report.ahead import ahead
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION, SPEED, STATE


def health(view: View, now_s: float) -> dict[str, dict[str, Any]]:
    inputs: dict[str, dict[str, Any]] = view.parts(now_s)["inputs"]
    return inputs


def whole(view: View) -> str:
    """All that a viewer is sent at first."""
    return Feed(lambda: view.parts(0.0)).whole()


def test_at_first_nothing_is_known() -> None:
    view = View()
    parts = view.parts(0.0)
    assert all(parts[name] is None for name in ("train", "adhesion", "supervision", "estimator", "place_m"))
    assert [said["state"] for said in parts["inputs"].values()] == ["never"] * len(EXPECTED)
    json.loads(whole(view))


def test_an_estimate_is_shown_in_the_units_of_people() -> None:
    view = View()
    estimate(view, 0)
    estimate(view, 2, mu=0.09)
    parts = view.parts(0.0)
    assert parts["train"] == {"t": 2.0, "position": 160.0, "speed": 288.0}
    assert parts["adhesion"] == {"mu": 0.09, "mu_lower": pytest.approx(0.085), "kind": "identified"}
    assert parts["estimator"]["dropped"] == {"LATE": "2"}
    assert [(row["t"], row["mu"], row["regime"]) for row in parts["history"].rows] == [
        (0.0, 0.08, "adhesion_limited"),
        (2.0, 0.09, "adhesion_limited"),
    ]
    json.loads(whole(view))


def test_supervision_is_shown_in_kmh_and_what_is_not_finite_is_unknown() -> None:
    view = View()
    view.supervised(STATUS, "brake")
    said = view.parts(0.0)["supervision"]
    assert (said["permitted"], said["sbi"], said["ebi"], said["indication"]) == (180.0, 187.2, 194.4, None)
    assert (said["target_m"], said["target_kmh"], said["left_m"]) == (6000.0, pytest.approx(100.0, abs=0.01), 3500.0)
    assert [(row["position"], row["permitted"]) for row in view.parts(0.0)["passed"].rows] == [(2500.0, 180.0)]


def test_without_a_safe_distance_there_are_no_limits() -> None:
    view = View()
    view.supervised({"level": "EMERGENCY_BRAKE", "target_position_m": "6000.0"}, "no safe distance is known")
    said = view.parts(0.0)["supervision"]
    assert (said["level"], said["permitted"], said["left_m"]) == ("EMERGENCY_BRAKE", None, None)
    assert view.parts(0.0)["passed"].rows == ()


def test_a_curve_begins_where_the_train_is() -> None:
    view = View()
    columns = (np.array(column) for column in ([0.0, 100.0], [50.0, 0.0], [1.0, 1.0], [0.0, 9.0]))
    view.curve("safe", StampedCurve(0, 1000.0, BrakingCurve(*columns)))
    assert view.parts(0.0)["curves"] == {"safe": {"x": [1000, 1100, 1100], "y": [180.0, 0.0, 0.0]}}


def test_the_health_of_an_input() -> None:
    view = View()
    for sample in range(100):
        view.heard(POSITION, 0.1 * sample)
    assert (health(view, 9.95)["position"]["state"], health(view, 9.95)["position"]["hz"]) == ("heard", 10.0)
    assert view.parts(12.0)["heard"]["position"] == 9.9
    assert health(view, 20.0)["position"]["hz"] == 0.0
    view.heard(BRAKE_PRESSURE, 9.9, "fluid_pressure = 410: is absolute")
    refused = health(view, 10.0)["brake_pressure"]
    assert (refused["state"], refused["why"]) == ("refused", "fluid_pressure = 410: is absolute")
    view.heard(BRAKE_PRESSURE, 10.0)
    assert health(view, 10.0)["brake_pressure"]["state"] == "heard"
    assert health(view, 10.0)[SPEED.name]["state"] == "never"


def test_what_is_refused_is_no_news_of_what_is_shown() -> None:
    view = View()
    view.heard(STATE, 1.0)
    view.heard(STATE, 2.0, "speed = nan")
    view.heard(STATE, 3.0, "speed = nan")
    parts = view.parts(3.0)
    assert (parts["heard"], parts["taken"]) == ({STATE.name: 3.0}, {STATE.name: 1.0})
    view.heard(STATE, 4.0)
    assert view.parts(4.0)["taken"] == {}


def test_what_is_withheld_is_not_shown_with_the_numbers_of_before() -> None:
    view = View()
    estimate(view, 0)
    view.train(TrainState(1001 * S, 80.0, 80.0))
    view.estimated({"regime": "COASTING"}, "positions stand still", alarming=True)
    parts = view.parts(0.0)
    assert parts["adhesion"] is None
    assert [row.get("mu") for row in parts["history"].rows] == [0.08, None]


@pytest.mark.parametrize("wild", ["1e308", "-1e308", "nan", "inf", "x" * 1_000_000])
def test_no_value_spoils_what_is_sent(wild: str) -> None:
    view = View()
    estimate(view, 0)
    view.supervised(dict.fromkeys(STATUS, wild), wild)
    view.estimated({"regime": wild, "accepted": wild[:9]}, wild)
    view.heard(SPEED, 1.0, wild)
    if len(wild) < 10:
        view.train(TrainState(2000 * S, float(wild), float(wild)))
        view.adhesion("mu", float(wild))
        view.place(float(wild))
    sent = whole(view)
    assert len(sent) < 10_000
    assert json.loads(sent)["all"]["supervision"]["ebi"] is None


def test_the_limits_ahead_are_those_of_the_monitor() -> None:
    config = SupervisionConfig(line_speed_kmh=320.0)
    braking, state = curve(CRH3, 80.0, 0.07), TrainState(0, 1500.0, 80.0, 0.5, 0.1)
    reading = read(config, braking, state, 300_000_000)
    numbers = {"target_position_m": 6000.0, "target_speed_mps": config.target_speed_mps, **reading._asdict()}
    limits = ahead(braking, numbers)
    assert limits is not None
    for name in ("permitted", "warning", "sbi", "ebi"):
        row = getattr(limits, f"{name}_mps")
        assert row[0] == pytest.approx(numbers[f"{name}_mps"], abs=0.01)
        assert np.all(np.diff(row) <= 1e-9), "they fall towards the target"
    later = read(config, braking, state._replace(position_m=3000.0), 300_000_000)
    assert np.interp(3024.0, limits.position_m, limits.ebi_mps) == pytest.approx(later.ebi_mps, abs=1.0)
    assert limits.position_m[0] == pytest.approx(6000.0 - reading.distance_to_target_m)


def test_limits_of_a_monitor_with_other_times_are_not_drawn() -> None:
    braking, state = curve(CRH3, 80.0, 0.07), TrainState(0, 1500.0, 80.0)
    reading = read(SupervisionConfig(driver_time_s=9.0), braking, state, 0)
    assert ahead(braking, {"target_position_m": 6000.0, "target_speed_mps": 27.778, **reading._asdict()}) is None
    assert ahead(braking, {"target_position_m": 6000.0}) is None


def test_a_falling_chainage_counts_along_the_run() -> None:
    view, braking = View(), curve(CRH3, 80.0, 0.07)
    view.curve("safe", StampedCurve(0, 8000.0, braking, -1))
    view.train(TrainState(S, 8000.0, -80.0))
    view.curve("safe", StampedCurve(0, 8000.0, braking, -1))
    view.place(8000.0)
    view.supervised(STATUS | {"target_position_m": "2000.0", "distance_to_target_m": "6000.0"}, "brake")
    parts = view.parts(0.0)
    assert (parts["sign"], parts["place_m"], parts["train"]["speed"]) == (-1, -8000.0, 288.0)
    assert (parts["supervision"]["target_m"], parts["passed"].rows[0]["position"]) == (-2000.0, -8000.0)
    assert parts["curves"]["safe"]["x"][:2] == sorted(parts["curves"]["safe"]["x"][:2])


def test_the_creep_curve_goes_through_its_peak() -> None:
    view = View()
    view.creep({"p1": "80", "p2": "100", "mu_max": "0.2", "lambda_m": "0.1", "withheld": "false"}, "known", 3.0)
    creep = view.parts(3.0)["creep"]
    assert (creep["peak"], creep["withheld"], creep["heard"]) == ([0.1, 0.2], False, 3.0)
    assert max(creep["y"]) == pytest.approx(0.2, abs=0.001)
    assert creep["x"][int(np.argmax(creep["y"]))] == pytest.approx(0.1, abs=0.01)
    view.creep({"p1": "nan"}, "", 4.0)
    assert view.parts(4.0)["creep"]["heard"] == 3.0

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What the live page is told: units, health of the inputs, histories, a new run; all of it fit for JSON."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.live.view import EXPECTED, LATE_S, MOST_POINTS, View
from adhesion_node.web import as_json
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION, SPEED

S = 10**9
STATUS = {
    "level": "OVERSPEED",
    "target_position_m": "6000.000",
    "target_speed_mps": "27.778",
    "distance_to_target_m": "3500.000",
    "margin_m": "369.000",
    **{f"{name}_mps": str(value) for name, value in (("permitted", 50), ("warning", 51), ("sbi", 52), ("ebi", 54))},
    "indication_mps": "nan",
}


def estimate(view: View, second: int, mu: float = 0.08, regime: str = "ADHESION_LIMITED") -> None:
    """What the estimator says each second, in its order."""
    view.adhesion("mu", mu)
    view.adhesion("mu_lower", mu - 0.005)
    view.train(TrainState(1000 * S + second * S, 80.0 * second, 80.0))
    view.estimated({"regime": regime, "accepted": "9", "dropped.LATE": "2", "confidence": "0.95"}, "all is well")


def health(view: View, now_s: float) -> dict[str, dict[str, Any]]:
    return {said["topic"]: said for said in view.parts(now_s)["inputs"]}


def test_at_first_nothing_is_known() -> None:
    parts = View().parts(0.0)
    assert all(parts[name] is None for name in ("train", "adhesion", "supervision", "estimator", "place_m"))
    assert [said["state"] for said in parts["inputs"]] == ["never"] * len(EXPECTED)
    json.loads(as_json(parts))


def test_an_estimate_is_shown_in_the_units_of_people() -> None:
    view = View()
    estimate(view, 0)
    estimate(view, 2, mu=0.09)
    parts = view.parts(0.0)
    assert parts["train"] == {"t": 2.0, "position": 160.0, "speed": 288.0}
    assert parts["adhesion"] == {"mu": 0.09, "mu_lower": pytest.approx(0.085)}
    assert parts["estimator"]["dropped"] == {"LATE": "2"}
    assert [(row["t"], row["mu"], row["regime"]) for row in parts["history"]] == [
        (0.0, 0.08, "adhesion_limited"),
        (2.0, 0.09, "adhesion_limited"),
    ]
    json.loads(as_json(parts))


def test_supervision_is_shown_in_kmh_and_what_is_not_finite_is_unknown() -> None:
    view = View()
    view.supervised(STATUS, "brake")
    said = view.parts(0.0)["supervision"]
    assert (said["permitted"], said["sbi"], said["ebi"], said["indication"]) == (180.0, 187.2, 194.4, None)
    assert (said["target_m"], said["target_kmh"], said["left_m"]) == (6000.0, pytest.approx(100.0, abs=0.01), 3500.0)
    assert [(row["position"], row["permitted"]) for row in view.parts(0.0)["passed"]] == [(2500.0, 180.0)]


def test_without_a_safe_distance_there_are_no_limits() -> None:
    view = View()
    view.supervised({"level": "EMERGENCY_BRAKE", "target_position_m": "6000.0"}, "no safe distance is known")
    said = view.parts(0.0)["supervision"]
    assert (said["level"], said["permitted"], said["left_m"]) == ("EMERGENCY_BRAKE", None, None)
    assert view.parts(0.0)["passed"] == ()


def test_a_curve_begins_where_the_train_is() -> None:
    view = View()
    columns = (np.array(column) for column in ([0.0, 100.0], [50.0, 0.0], [1.0, 1.0], [0.0, 9.0]))
    view.curve("safe", StampedCurve(0, 1000.0, BrakingCurve(*columns)))
    assert view.parts(0.0)["curves"] == {"safe": {"x": [1000.0, 1100.0], "y": [180.0, 0.0]}}


def test_the_health_of_an_input() -> None:
    view = View()
    for sample in range(100):
        view.heard(POSITION, 0.1 * sample)
    assert (health(view, 9.95)["position"]["state"], health(view, 9.95)["position"]["hz"]) == ("good", 10.0)
    late = health(view, 9.9 + LATE_S + 0.1)["position"]
    assert (late["state"], late["age"]) == ("late", 2.1)
    assert health(view, 20.0)["position"]["hz"] == 0.0
    view.heard(BRAKE_PRESSURE, 9.9, "fluid_pressure = 410: is absolute")
    refused = health(view, 10.0)["brake_pressure"]
    assert (refused["state"], refused["why"]) == ("refused", "fluid_pressure = 410: is absolute")
    view.heard(BRAKE_PRESSURE, 10.0)
    assert health(view, 10.0)["brake_pressure"]["state"] == "good"
    assert health(view, 10.0)[SPEED.name]["state"] == "never"


def test_stamps_that_go_back_begin_a_new_run() -> None:
    view = View()
    for second in (0, 1, 2):
        estimate(view, second)
    view.supervised(STATUS, "brake")
    estimate(view, 0)  # a recording that is played again
    assert [row["t"] for row in view.parts(0.0)["history"]] == [0.0]
    assert view.parts(0.0)["passed"] == ()


def test_histories_are_bounded() -> None:
    view = View()
    for second in range(MOST_POINTS + 5):
        estimate(view, second)
        view.supervised(STATUS | {"distance_to_target_m": str(6000.0 - 80.0 * second)}, "brake")
    parts = view.parts(0.0)
    assert (len(parts["history"]), parts["history"][-1]["t"]) == (MOST_POINTS, MOST_POINTS + 4.0)
    assert len(parts["passed"]) == MOST_POINTS


def test_a_quick_estimator_fills_a_history_no_faster() -> None:
    view = View()
    for tenth in range(31):
        view.adhesion("mu", 0.08)
        view.adhesion("mu_lower", 0.07)
        view.train(TrainState(S + tenth * S // 10, 5.0 * tenth, 50.0))
        view.supervised(STATUS | {"distance_to_target_m": str(6000.0 - 5.0 * tenth)}, "brake")
        view.estimated({"regime": "COASTING"}, "")
    assert [row["t"] for row in view.parts(0.0)["history"]] == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert [row["position"] for row in view.parts(0.0)["passed"]] == [20.0 * k for k in range(8)]


def test_what_was_given_out_does_not_change() -> None:
    view = View()
    estimate(view, 0)
    before = view.parts(0.0)
    text = as_json(before)
    estimate(view, 1, mu=0.1)
    assert as_json(before) == text


def test_at_the_end_the_ages_stand_still() -> None:
    view = View()
    view.heard(POSITION, 10.0)
    view.end(10.5)
    parts = view.parts(60.0)
    assert parts["ended"] is True
    assert (parts["inputs"][0]["state"], parts["inputs"][0]["age"]) == ("good", 0.5)

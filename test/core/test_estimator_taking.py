# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the estimator makes of every measurement: taken, refused, waited for; a jump of the stamps, another place."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from oracles import drive, ride
from quick_window import QUICK, STOP, counts

from adhesion_node.core import Measurement, Outcome, init, step
from adhesion_node.core.intake.samples import ImuSample, SpeedSample


@pytest.mark.parametrize(
    "changes",
    [
        {"position_m": math.nan},
        {"position_m": math.inf},
        {"position_m": 1e12},
        {"variance_m2": 0.0},
        {"variance_m2": -0.25},
        {"variance_m2": math.nan},
        {"variance_m2": 1e-310},
        {"brake_pressure_pa": math.nan},
        {"speed_mps": math.inf},
        {"speed_mps": 1e3},
        {"speeds": (SpeedSample(1, 20.0, math.inf),)},
        {"imu": (ImuSample(1, 0.1, math.inf),)},
    ],
)
def test_invalid_is_counted_and_changes_nothing(changes: dict[str, Any]) -> None:
    measurements = ride(STOP)
    bad = [m._replace(t_ns=m.t_ns + 1, **changes) for m in measurements[40:120:10]]
    _, expected = drive(QUICK, measurements)
    state, estimates = drive(QUICK, sorted([*measurements, *bad], key=lambda m: m.t_ns))
    assert counts(state) == {"ACCEPTED": 130, "INVALID": 8}
    assert estimates == expected


def _with_extra(measurements: list[Measurement], at: int, extra: Measurement) -> list[Measurement]:
    return [*measurements[:at], extra, *measurements[at:]]


@pytest.mark.parametrize("lag_s", [0.0, 0.35])
@pytest.mark.parametrize("at", [30, 90])
@pytest.mark.parametrize("name", ["LATE", "DUPLICATE", "DUPLICATE of another sensor", "OUTLIER"])
def test_refused_is_counted_and_changes_nothing(name: str, at: int, lag_s: float) -> None:
    config, measurements = replace(QUICK, max_lag_s=lag_s), ride(STOP)
    newest = measurements[at - 1]
    extra = {
        "LATE": measurements[at - 8]._replace(t_ns=measurements[at - 8].t_ns + 1),
        "DUPLICATE": newest._replace(position_m=newest.position_m - 0.3),  # the first to come counts
        "DUPLICATE of another sensor": newest._replace(brake_pressure_pa=None, speed_mps=70.0),
        "OUTLIER": newest._replace(t_ns=newest.t_ns + 10, position_m=newest.position_m + 30.0),
    }[name]
    _, expected = drive(config, measurements)
    state, estimates = drive(config, _with_extra(measurements, at, extra))
    assert counts(state) == {"ACCEPTED": 130, name.split(maxsplit=1)[0]: 1}
    assert estimates == expected


def test_the_outcome_of_the_last_measurement_is_told() -> None:
    state = init(QUICK, 0)
    for measurement, outcome in (
        (Measurement(10**9, 0.0, 1.0), Outcome.ACCEPTED),
        (Measurement(10**9, 0.0, 1.0), Outcome.DUPLICATE),
        (Measurement(9 * 10**8, 0.0, 1.0), Outcome.LATE),
        (Measurement(11 * 10**8, math.nan, 1.0), Outcome.INVALID),
        (Measurement(12 * 10**8, 1e6, 1.0), Outcome.OUTLIER),
        (Measurement(13 * 10**8, 20.0, 1.0), Outcome.ACCEPTED),
    ):
        state, _ = step(QUICK, state, measurement)
        assert state.outcome is outcome
    assert all(outcome.value for outcome in Outcome)


@pytest.mark.parametrize("jump_s", [-1000.0, -61.5, 75.0, 1e6])
def test_a_jump_of_the_stamps_starts_anew(jump_s: float) -> None:
    """As a bag that is played in a loop: the second pass is the first one again, up to the windows' random numbers."""
    cruise, measurements = ride([(5.0, 0.0)]), ride(STOP, seed=1)
    later = [m._replace(t_ns=m.t_ns + round((5.0 + jump_s) * 1e9)) for m in measurements]
    state, estimates = drive(QUICK, [*cruise, *later])
    _, alone = drive(QUICK, measurements)
    assert counts(state) == {"ACCEPTED": 180, "RESET": 1}
    assert [e._replace(t_ns=0) for e in estimates[-len(alone) :]] == [e._replace(t_ns=0) for e in alone]


def test_a_train_that_is_elsewhere_is_followed_there() -> None:
    measurements = ride([(12.0, 0.0)])
    moved = [m._replace(position_m=m.position_m + 5000.0 * (k >= 60)) for k, m in enumerate(measurements)]
    state, estimates = drive(replace(QUICK, max_outliers=4), moved)
    assert counts(state) == {"ACCEPTED": 117, "OUTLIER": 3, "RESET": 1}
    assert estimates[-1].position_m == pytest.approx(5000 + 80 * 11.9, abs=1.0)


def test_outliers_now_and_then_are_no_other_place() -> None:
    measurements = ride([(12.0, 0.0)])
    jumping = [m._replace(position_m=m.position_m + 50.0 * (k % 10 == 9)) for k, m in enumerate(measurements)]
    state, _ = drive(replace(QUICK, max_outliers=2), jumping)
    assert counts(state) == {"ACCEPTED": 108, "OUTLIER": 12}


def test_shuffled_within_the_lag_is_the_ordered_run() -> None:
    config, measurements = replace(QUICK, max_lag_s=0.5), ride(STOP)
    _, ordered = drive(config, measurements)
    assert ordered == drive(QUICK, measurements)[1]  # waiting changes no number
    rng = np.random.default_rng(3)
    for _ in range(5):
        delays = np.arange(130) * 0.1 + rng.uniform(0.0, 0.45, 130)
        shuffled = [measurements[int(k)] for k in np.argsort(delays)]
        assert shuffled != measurements
        state, estimates = drive(config, shuffled)
        assert counts(state) == {"ACCEPTED": 130}
        assert estimates == ordered


def test_results_wait_no_longer_than_the_lag_when_the_rate_falls() -> None:
    config, measurements = replace(QUICK, max_lag_s=1.0), ride([(20.0, 0.0)])
    state = init(config, 0)
    for measurement in [*measurements[:100], *measurements[100::10]]:
        state, _ = step(config, state, measurement)
        for waiting in state.inbox.anchors.samples[:1]:
            assert measurement.t_ns - waiting.t_ns <= 1_000_000_000

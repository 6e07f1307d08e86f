# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What truly was at the times of the estimates, on hand-made journeys."""

from __future__ import annotations

import numpy as np
import pytest
from driven import FROM_MPS, FROM_S, drive, journey

from adhesion_node.core import Config, Estimate, Prediction, Regime
from adhesion_node.core.physics import braking
from adhesion_node.core.physics.train import GRAVITY
from adhesion_node.run.results.used import averaged
from adhesion_node.study.real.trials import arrays, naive, rows_of
from adhesion_node.study.real.truth import borders, truth_at
from adhesion_node.study.trial.estimators import LaneResult, Output
from sim_node.real.drive import START_S

MADE = journey()


def test_used_is_the_mean_over_the_second_around_it() -> None:
    used = np.where(MADE.time_s < 30.0, 0.02, 0.06)
    mean = averaged(np.round(1e9 * MADE.time_s).astype(np.int64), used)
    assert np.interp([20.0, 29.4, 29.99, 30.6, 0.0, 79.9], MADE.time_s, mean) == pytest.approx(
        [0.02, 0.02, 0.04, 0.06, 0.02, 0.06], abs=5e-4
    )


def test_axles_that_slid_lately_count_and_rolling_ones_do_not() -> None:
    wheels = MADE.wheel_radps.copy()
    at = (MADE.time_s >= 20.0) & (MADE.time_s < 20.5)
    wheels[at, 0] *= 0.6
    wheels[(MADE.time_s >= 22.0) & (MADE.time_s < 22.1), 1] *= 0.6
    truth = truth_at(MADE._replace(wheel_radps=wheels), np.array([19.9, 20.2, 22.05, 23.2, 23.6, 25.2]))
    assert truth.slid == pytest.approx([0.0, 0.25, 0.5, 0.5, 0.25, 0.0])


def test_the_way_that_remains_is_the_true_one_under_the_full_brake() -> None:
    truth = truth_at(MADE, np.array([5.0, FROM_S + 0.01, 30.0, 75.0]))
    assert truth.remaining_m == pytest.approx([np.nan, FROM_MPS**2, 400.0, 0.0], abs=0.5, nan_ok=True)
    assert truth.true_speed_mps == pytest.approx([FROM_MPS, FROM_MPS, 20.0, 0.0], abs=0.01)


def test_a_border_is_where_a_quarter_is_lost_or_won_within_100_m() -> None:
    place = MADE.position_m
    offered = np.where(place < 500.0, 0.1, np.where(place < 800.0, 0.05, 0.08))
    fall, rise = borders(MADE._replace(available=offered))
    assert (fall.ratio, rise.ratio) == pytest.approx((0.5, 1.6))
    for border, at_m in ((fall, 500.0), (rise, 800.0)):
        assert border.start_s == pytest.approx(border.end_s, abs=0.05)
        assert np.interp(border.start_s, MADE.time_s, place) == pytest.approx(at_m, abs=1.0)
    gentle = np.interp(place, [200.0, 1000.0], [0.1, 0.05])
    assert borders(MADE._replace(available=gentle)) == []


def test_a_long_train_takes_its_length_to_pass_a_border() -> None:
    offered = np.interp(MADE.position_m, [500.0, 700.0], [0.1, 0.03])
    (fall,) = borders(MADE._replace(available=offered))
    ends_m = np.interp([fall.start_s, fall.end_s], MADE.time_s, MADE.position_m)
    assert ends_m == pytest.approx([512.0, 695.0], abs=8.0)
    assert fall.ratio == pytest.approx(0.3)


def test_the_naive_estimate_is_the_deceleration_without_the_resistance() -> None:
    config = Config()
    stamps = np.array([1.0, 40.0, 69.0])
    found = naive(drive(MADE), config, stamps, stamps + 0.15)
    resistance = [config.train.specific_resistance(np.array(speed)) for speed in (FROM_MPS, 15.0, 0.5)]
    expected = [-resistance[0], 0.5 / GRAVITY - resistance[1], 0.5 / GRAVITY - resistance[2]]
    assert found == pytest.approx(expected, abs=1e-6)
    assert np.isnan(naive(drive(MADE), config, np.array([0.2]), np.array([0.35]))).all()


def test_an_estimate_stands_beside_the_truth_of_its_stamp() -> None:
    config = Config()
    curve = braking.curve(config.train, 20.0, 0.05)
    estimate = Estimate(
        round((START_S + 30.0) * 1e9), 0.04, 0.01, 0.03, Regime.BRAKE_LIMITED, 0.0, 20.5, 1.0, 0.25, changes=2
    )
    outputs = [
        Output(Prediction(estimate, curve, None), START_S + 30.2),
        Output(Prediction(estimate._replace(withheld=True), None, None), START_S + 30.7),
    ]
    first, second = rows_of(drive(MADE), config, LaneResult(outputs))
    told = [
        first[name] for name in ("seed", "t_s", "out_s", "mu", "std", "lower", "speed_mps", "speed_std_mps", "changes")
    ]
    assert told == pytest.approx([1, 30.0, 30.2, 0.04, 0.01, 0.03, 20.5, 0.25, 2])
    truths = [first[name] for name in ("true_speed_mps", "used", "available", "slid", "remaining_m")]
    assert truths == pytest.approx([20.0, 0.05, 0.06, 0.0, 400.0], abs=1e-3)
    assert (first["regime"], first["safe_m"]) == ("BRAKE_LIMITED", curve.distance_m[-1])
    assert first["naive"] == pytest.approx(0.5 / GRAVITY - config.train.specific_resistance(np.array(20.0)))
    assert (bool(first["withheld"]), bool(second["withheld"]), np.isnan(second["safe_m"])) == (False, True, True)


def test_a_drive_goes_through_the_pipeline_message_by_message() -> None:
    made = drive(MADE)
    broken = [
        (at_s, message._replace(frame="map") if at_s > START_S + 60.0 else message) for at_s, message in made.messages
    ]
    found = arrays(made._replace(messages=tuple(broken)), Config(), 2.0)
    (run,) = found["runs"]
    assert [run[name] for name in ("full_s", "built_s", "slow_s", "full_mps")] == pytest.approx(
        [10.0, 12.0, 64.0, FROM_MPS], abs=0.03
    )
    rows = found["rows"]
    assert np.all(rows["out_s"] >= rows["t_s"] + 0.0999)
    assert rows["t_s"][-1] == pytest.approx(79.9, abs=0.5), "it is followed by its pressures"
    assert {str(drop["reason"]): int(drop["count"]) for drop in found["drops"]} == {"WRONG_FRAME": 201}
    while_braking = rows[(rows["t_s"] > 30.0) & (rows["t_s"] < 55.0)]
    assert while_braking["speed_mps"] == pytest.approx(while_braking["true_speed_mps"], abs=0.3)

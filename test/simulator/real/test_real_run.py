# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A drive as the run of a simulator: truth at its rate, each message by itself when it arrives."""

import numpy as np
import pytest
from rides import SPEED_MPS, ride

from adhesion_node.wire.topics import POSITION
from sim_node.real.drive import START_S, Drive, sense
from sim_node.real.plant.scenarios import SCENARIOS as REAL
from sim_node.real.run import ticks, truths
from sim_node.real.sensors.fitted import FITTED
from sim_node.train.plant import ADHESION_LIMITED, BRAKE_LIMITED, COASTING
from sim_node.train.scenario import SCENARIOS

RIDE = ride(cruise_s=20.0)
DRIVE = Drive(RIDE.journey, sense(RIDE, FITTED["gnss_wheels"]))
TICKS = list(ticks(DRIVE, 0.1))


def test_each_message_comes_by_itself_when_it_arrives() -> None:
    assert max(len(messages) for _, messages in TICKS) == 1
    times = np.array([truth.t_ns for truth, _ in TICKS])
    assert (np.diff(times) >= 0).all()
    arrived = [(truth.t_ns, messages[0].values) for truth, messages in TICKS if messages]
    expected = [(round((at_s - START_S) * 1e9), message.values) for at_s, message in DRIVE.messages]
    assert arrived == expected[: len(arrived)]
    assert len(expected) - len(arrived) < 10  # on their way at the end


def test_stamps_count_from_the_beginning_of_the_journey() -> None:
    late = [truth.t_ns - sent[0].t_ns for truth, sent in TICKS if sent and sent[0].topic is POSITION]
    assert 0.05e9 <= min(late) < max(late) < 0.16e9


def test_the_truth_comes_at_its_rate_with_the_adhesion_that_is_used() -> None:
    alone = [truth for truth, messages in TICKS if not messages]
    assert [truth.t_ns for truth in alone[:4]] == [0, 100_000_000, 200_000_000, 300_000_000]
    braked = [truth for truth in alone if truth.t_ns > 21e9]
    assert {truth.mu for truth in braked} == {0.08}
    assert braked[0].position_m == pytest.approx(
        RIDE.at(np.array(braked[0].t_ns * 1e-9), RIDE.journey.position_m), abs=1
    )


def test_adhesion_limits_where_half_of_the_groups_slid_within_3_s() -> None:
    time_s = RIDE.journey.time_s
    wheels = RIDE.journey.speed_mps[:, np.newaxis] / RIDE.journey.radius_m
    for group in range(wheels.shape[1] // 2):  # one behind the other
        wheels[(time_s > 30.0 + group / 10) & (time_s < 30.1 + group / 10), group] *= 0.9
    journey = RIDE.journey._replace(wheel_radps=wheels)
    told = truths(journey)
    assert {truth.regime for truth in told if truth.t_ns < 20e9} == {COASTING}
    assert {truth.regime for truth in told if 21e9 < truth.t_ns < 30e9} == {BRAKE_LIMITED}
    assert {truth.regime for truth in told if 30.2e9 < truth.t_ns < 33.0e9} == {ADHESION_LIMITED}
    assert {truth.regime for truth in told if 33.2e9 < truth.t_ns < 40e9} == {BRAKE_LIMITED}
    assert told[0].speed_mps == SPEED_MPS


def test_no_scenario_of_a_real_train_is_named_as_one_of_the_paper() -> None:
    assert not set(REAL) & set(SCENARIOS)

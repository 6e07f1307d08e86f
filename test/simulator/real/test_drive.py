# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Drives of the real train: messages in order of arrival, equal from equal seeds, each sensor by itself."""

import numpy as np
import pytest
from rides import ride

from adhesion_node.core import Config
from adhesion_node.core.setting import make
from adhesion_node.wire.messages.codec import plain
from adhesion_node.wire.topics import POSITION, SPEED, WHEEL_SPEED
from sim_node.real.drive import START_S, sense
from sim_node.real.sensors.fitted import FITTED
from sim_node.real.sensors.position import Gnss
from sim_node.train.sensors import SensorMessage

RIDE = ride(cruise_s=20.0)
ENDS_S = float(RIDE.journey.time_s[-1])


@pytest.mark.parametrize("name", FITTED)
def test_messages_come_in_order_of_arrival_within_the_journey(name: str) -> None:
    messages = sense(RIDE, FITTED[name])
    arrivals = np.array([arrival_s for arrival_s, _ in messages])
    assert (np.diff(arrivals) >= 0.0).all()
    assert START_S <= arrivals[0] < START_S + 4.5
    assert arrivals[-1] < START_S + ENDS_S + 0.5
    assert {message.topic for _, message in messages} == {one.sensor.topic for one in FITTED[name].sensors.values()}


def test_equal_seeds_give_equal_messages_and_others_others() -> None:
    full = FITTED["full"]
    first, again, other = (sense(ride(seed, 20.0), full) for seed in (1, 1, 2))
    assert first == again
    assert {message.values for _, message in first}.isdisjoint(message.values for _, message in other)


def test_a_sensor_shows_the_same_in_every_set_that_has_it() -> None:
    positions = [
        [sent for sent in sense(RIDE, FITTED[name]) if sent[1].topic is POSITION]
        for name in ("gnss", "gnss_doppler", "full", "no_pressure")
    ]
    assert all(one == positions[0] for one in positions)


def test_position_and_speed_of_a_receiver_share_their_stamps_and_outages() -> None:
    stamps = [
        {message.t_ns for _, message in sense(RIDE, FITTED["gnss_doppler"]) if message.topic is topic}
        for topic in (POSITION, SPEED)
    ]
    assert stamps[0] == stamps[1]


def test_a_late_receiver_sends_its_history_first_and_then_each_fix_late() -> None:
    sent = [(arrival_s, m.t_ns * 1e-9) for arrival_s, m in sense(RIDE, FITTED["gnss_late"]) if m.topic is POSITION]
    assert [arrival_s for arrival_s, _ in sent[:35]] == [START_S + 4.0] * 35
    late = [arrival_s - stamp_s for arrival_s, stamp_s in sent[50:]]
    assert 0.3 <= min(late) < max(late) < 0.41


def test_the_recorded_receivers_differ_as_two_on_a_train_did() -> None:
    gnss = FITTED["gnss_recorded"].sensors["position"].sensor
    assert isinstance(gnss, Gnss)
    times = np.arange(0.0, 7200.0, 0.2)
    errors = [[gnss.errors(times, np.random.default_rng([k, side])) for side in (0, 1)] for k in range(40)]
    differences = np.diff(errors, axis=1)[:, 0]
    over_60_s = differences[:, 300:] - differences[:, :-300]
    assert differences.std() == pytest.approx(5.7, rel=0.1)
    assert over_60_s.std() == pytest.approx(1.45, rel=0.05)


def test_outages_leave_gaps_of_seconds() -> None:
    stamps = [m.t_ns * 1e-9 for seed in range(5) for m in _positions(seed, "gnss_outages")]
    gaps = np.diff(stamps)
    assert 2.0 < gaps[gaps > 0.2].max() < 25.0
    assert np.isclose(gaps, 0.1, atol=1e-6).mean() > 0.95


def _positions(seed: int, name: str) -> list[SensorMessage]:
    return [message for _, message in sense(ride(seed, 20.0), FITTED[name]) if message.topic is POSITION]


@pytest.mark.parametrize("name", sorted(set(FITTED) - {"fix"}))
def test_messages_can_be_read_as_those_of_a_train(name: str) -> None:
    for _, message in sense(RIDE, FITTED[name]):
        sample = message.topic.read(message.build(plain))
        assert sample.t_ns == message.t_ns


@pytest.mark.parametrize(
    ("name", "pressure_kind", "speed_source"),
    [
        ("gnss", "demanded", "axle"),
        ("gnss_doppler", "demanded", "doppler"),
        ("radar", "demanded", "radar"),
        ("axle_speed", "demanded", "axle"),
        ("one_cylinder_wheels", "cylinder", "axle"),
        ("mean_cylinder_demand", "mean", "axle"),
        ("full", "mean", "doppler"),
    ],
)
def test_an_estimator_can_be_told_what_the_sensors_are(name: str, pressure_kind: str, speed_source: str) -> None:
    config = make(Config, FITTED[name].told)
    assert (config.pressure_kind, config.speed_source) == (pressure_kind, speed_source)


def test_stamps_are_off_by_a_second_for_minutes() -> None:
    late = {
        round(arrival_s - message.t_ns * 1e-9)
        for seed in range(6)
        for arrival_s, message in sense(ride(seed, 20.0), FITTED["gnss_stamps"])
        if message.topic is POSITION
    }
    assert late == {-1, 0, 1}


def test_wheels_are_published_with_one_name_for_every_group() -> None:
    (first, *_) = (m for _, m in sense(RIDE, FITTED["gnss_wheels"]) if m.topic is WHEEL_SPEED)
    assert first.build(plain).name == ["axle_1", "axle_2", "axle_3", "axle_4"]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The table of topics: one codec for rclpy, rosbags and plain objects, and brake pressures in thin air."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from messages import brake_pressure
from test_convert import as_rosbags

from adhesion_node.bag import encode, serialize
from adhesion_node.bag import types as bag_types
from adhesion_node.core import Estimate, ImuSample, Regime, SpeedSample
from adhesion_node.core.physics import braking
from adhesion_node.core.physics.train import CRH3
from adhesion_node.core.prediction import Prediction
from adhesion_node.nodes.ros import types
from adhesion_node.wire.line import ATMOSPHERE_PA, Line
from adhesion_node.wire.messages.codec import plain
from adhesion_node.wire.messages.curves import Target
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.messages.results import Status
from adhesion_node.wire.topic import Role, Topic
from adhesion_node.wire.topics import (
    ATP_TARGET,
    BRAKE_DEMAND,
    BRAKE_PRESSURE,
    CLOCK,
    FIX,
    IMU,
    ODOMETRY,
    POSITION,
    SPEED,
    TOPICS,
    TRACTION_FORCE,
    TRUTH_LIMITED,
    TRUTH_MU,
    TRUTH_STATE,
    WHEEL_SPEED,
)
from adhesion_node.wire.track_line import line_of

T_NS = 12_000_000_034

CURVE = braking.curve(CRH3, 80.0, 0.08, target_mps=10.0)
ESTIMATE = Estimate(T_NS, 0.08, 0.01, 0.07, Regime.ADHESION_LIMITED, 2000.0, 80.0, 0.2, 0.1)

MAPPED = Line(track=line_of("a meridian", np.array([47.0, 47.01]), np.array([8.0, 8.0]), None, 0.0))

PEAK = SimpleNamespace(known=True, mu_max=0.35, lambda_m=0.1)
"""All that is written of a CreepEstimate."""

SENSED = {
    POSITION: ((1234.5,), 0.25),
    FIX: ((47.001, 8.0, math.nan), 0.25),
    ODOMETRY: ((1234.5,), 0.25),
    BRAKE_PRESSURE: ((511_325.0,), 0.0),
    BRAKE_DEMAND: ((411_325.0,), 0.0),
    SPEED: ((83.3,), 0.01),
    IMU: ((-1.2,), 0.0025),
    WHEEL_SPEED: ((180.0, -0.5), 0.0),
    TRACTION_FORCE: ((-3e5,), 0.0),
}
"""Numbers of the message and their variance for every sensor."""


def values_of(topic: Topic) -> tuple[Any, ...]:
    """Return what the writer of a topic takes."""
    if topic.role is Role.SENSOR:
        return T_NS, *SENSED[topic]
    if topic.role is Role.ADHESION:
        return (Prediction(ESTIMATE, CURVE, CURVE),)
    if topic.role is Role.STATUS:
        return T_NS, Status("node/part", 1, "slow", {"a": "1"})
    others: dict[Topic, tuple[Any, ...]] = {
        TRUTH_STATE: (T_NS, 1500.0, 70.0),
        TRUTH_MU: (0.0726,),
        TRUTH_LIMITED: (True,),
        ATP_TARGET: (T_NS, Target(6000.0, 27.8)),
        CLOCK: (T_NS,),
    }
    return others.get(topic, (PEAK,))


def by_name(topic: Topic) -> str:
    return topic.name


@pytest.mark.parametrize("topic", TOPICS, ids=by_name)
def test_one_codec_serves_rclpy_rosbags_and_plain_objects(topic: Topic) -> None:
    """What is built is the same bytes in a recording and over ROS, and reads the same everywhere."""
    values = values_of(topic)
    live, recorded, plainly = (topic.build(new, *values) for new in (types.new, bag_types.new, plain))
    canonical = as_rosbags(live, topic.type)
    assert serialize(canonical, topic.type) == serialize(recorded, topic.type) == encode(topic, *values)
    assert len({repr(topic.read(message, MAPPED)) for message in (live, recorded, plainly, canonical)}) == 1


@pytest.mark.parametrize("topic", [topic for topic in SENSED if topic is not FIX], ids=by_name)
def test_what_is_read_of_a_sensor_is_what_was_built(topic: Topic) -> None:
    values, variance = SENSED[topic]
    sample = topic.read(topic.build(plain, T_NS, values, variance))
    gauge = (values[0] - ATMOSPHERE_PA,) if topic in (BRAKE_PRESSURE, BRAKE_DEMAND) else values
    assert tuple(sample) in ((T_NS, *gauge), (T_NS, gauge), (T_NS, *gauge, variance))


def test_a_name_stands_once() -> None:
    assert len({topic.name for topic in TOPICS}) == len(TOPICS)


def pressure(absolute_pa: float) -> Any:
    return brake_pressure(T_NS, absolute_pa, 0.0)


@pytest.mark.parametrize(
    ("told", "variance"), [(0.04, 0.04), (0.0, None), (-1.0, None), (math.nan, None), (1e300, None)]
)
def test_a_speed_has_the_variance_of_its_message_and_zero_is_unknown(told: float, variance: float | None) -> None:
    assert SPEED.read(SPEED.build(plain, T_NS, (70.0,), told)) == SpeedSample(T_NS, 70.0, variance)


def test_an_imu_that_measures_no_acceleration_is_refused() -> None:
    assert IMU.read(IMU.build(plain, T_NS, (-0.9,), 0.0)) == ImuSample(T_NS, -0.9, None)
    assert IMU.read(IMU.build(plain, T_NS, (-0.9,), 0.01)) == ImuSample(T_NS, -0.9, 0.01)
    with pytest.raises(Rejected, match=r"covariance\[0\] = -1: .* says that none is measured"):
        IMU.read(IMU.build(plain, T_NS, (-0.9,), -1.0))
    with pytest.raises(Rejected, match=r"acceleration x = nan"):
        IMU.read(IMU.build(plain, T_NS, (math.nan,), 0.01))


def test_an_axle_without_a_speed_leaves_the_others() -> None:
    """A bogie that has dropped out: the message was refused as a whole."""
    sample = WHEEL_SPEED.read(WHEEL_SPEED.build(plain, T_NS, (math.nan, 20.0, math.nan, 21.0)))
    assert sample.is_valid()
    assert sample.known_radps == (20.0, 21.0)
    assert len(sample.speeds_radps) == 4
    with pytest.raises(Rejected, match=r"wheel speed of axle_1 = nan: give a finite number"):
        WHEEL_SPEED.read(WHEEL_SPEED.build(plain, T_NS, (math.nan, math.nan)))
    with pytest.raises(Rejected, match=r"wheel speed of axle_2 = inf"):
        WHEEL_SPEED.read(WHEEL_SPEED.build(plain, T_NS, (math.nan, math.inf)))


def test_high_up_the_air_is_thin_and_a_full_brake_is_full() -> None:
    """At 58 kPa of air a cylinder of 410 kPa gauge holds 468 kPa; by the sea's air it would read 367."""
    high = Line(ambient_pressure_pa=58e3)
    assert BRAKE_PRESSURE.read(pressure(468e3), high).pressure_pa == 410e3
    assert BRAKE_PRESSURE.read(pressure(58e3), high).pressure_pa == 0.0
    assert BRAKE_PRESSURE.read(pressure(468e3)).pressure_pa == pytest.approx(367e3, abs=400)


@pytest.mark.parametrize("air_pa", [53e3, 47e3])
def test_the_air_of_the_highest_railway_is_no_reason_to_refuse(air_pa: float) -> None:
    assert BRAKE_PRESSURE.read(pressure(air_pa), Line(ambient_pressure_pa=air_pa)).pressure_pa == 0.0


@pytest.mark.parametrize("ambient_pa", [44e3, 120e3, math.nan])
def test_there_is_no_such_air(ambient_pa: float) -> None:
    with pytest.raises(ValueError, match=r"ambient_pressure_pa = .*: give a value from 45000 to 110000 Pa"):
        Line(ambient_pressure_pa=ambient_pa)

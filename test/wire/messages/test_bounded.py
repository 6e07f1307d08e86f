# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What messages may weigh: texts are cut and cannot steer a terminal, axles and points are bounded."""

from __future__ import annotations

from copy import deepcopy

import messages
import numpy as np
import pytest
from sensor_msgs.msg import JointState

from adhesion_node.core.intake.outcome import LONGEST, Event, Outcome
from adhesion_node.core.intake.samples import WheelSample
from adhesion_node.core.physics import braking
from adhesion_node.core.physics.train import CRH3
from adhesion_node.wire import topics
from adhesion_node.wire.messages.refused import MOST_AXLES, MOST_POINTS, Reason, Rejected
from adhesion_node.wire.topic import Topic

T_NS = 10**9
STEERS = "\x1b[2J\x9b31m\u202e\n" + "x" * 1_000_000
"""It clears the screen, colours it, turns the text round, and is a megabyte long."""


def refused(topic: Topic, message: object) -> Rejected:
    with pytest.raises(Rejected) as refusal:
        topic.read(message)
    text = str(refusal.value)
    assert text.isprintable()
    assert len(text) <= LONGEST + len(max((reason.value for reason in Reason), key=len)) + 3
    return refusal.value


def axles(count: int, name: str = "axle") -> JointState:
    names = [f"{name}_{number}" for number in range(count)]
    return JointState(header=messages.header(T_NS), name=names, velocity=[30.0] * count)


def test_a_frame_of_any_length_is_told_in_one_line() -> None:
    message = messages.position(T_NS, 10.0, 0.5)
    message.header.frame_id = STEERS
    refusal = refused(topics.POSITION, message)
    assert refusal.reason == "WRONG_FRAME"
    assert "set header.frame_id" in str(refusal), "the remedy is not cut"


def test_names_of_any_length_are_told_in_one_line() -> None:
    wrong = axles(2, STEERS)
    wrong.velocity = [1e9, 30.0]
    assert refused(topics.WHEEL_SPEED, wrong).reason == "IMPLAUSIBLE_WHEEL_SPEED"
    wrong.velocity = [30.0]
    assert refused(topics.WHEEL_SPEED, wrong).reason == "NO_AXLE"
    curve = messages.curve_message(T_NS, braking.curve(CRH3, 30.0, 0.1), 0.0)
    curve.joint_names = [STEERS] * 3
    assert refused(topics.BRAKING_CURVE, curve).reason == "BAD_CURVE"
    assert refused(topics.ATP_TARGET, curve).reason == "BAD_TARGET"


def test_so_many_axles_are_read_and_no_more() -> None:
    assert len(topics.WHEEL_SPEED.read(axles(MOST_AXLES)).speeds_radps) == MOST_AXLES
    for count in (MOST_AXLES + 1, 50_000):
        refusal = refused(topics.WHEEL_SPEED, axles(count))
        assert refusal.reason == "MANY_AXLES"
        assert f"wheel speed names = {count}: give at most {MOST_AXLES}" in str(refusal)


def test_so_many_points_are_read_and_no_more() -> None:
    made = braking.curve(CRH3, 80.0, 0.1)
    speeds = np.linspace(80.0, 30.0, MOST_POINTS)
    way = (80.0**2 - speeds**2) / 2.0
    steady = braking.BrakingCurve(way, speeds, np.ones_like(way), 80.0 - speeds)
    message = messages.curve_message(T_NS, steady, 0.0)
    assert topics.BRAKING_CURVE.read(message).curve.speed_mps.size == MOST_POINTS > 10 * made.speed_mps.size
    message = deepcopy(message)
    message.points = [*message.points, message.points[-1]]
    refusal = refused(topics.BRAKING_CURVE, message)
    assert refusal.reason == "BAD_CURVE"
    assert f"points = {MOST_POINTS + 1}" in str(refusal)


def test_an_event_is_one_line_however_much_came() -> None:
    """A sample from Python is told as it is written."""
    text = str(Event(Outcome.INVALID, repr(WheelSample(T_NS, (float("inf"),) * 50_000))))
    assert len(text) <= LONGEST + 3 + len(Outcome.INVALID.value)
    assert text.endswith(Outcome.INVALID.value)
    assert str(Event(Outcome.INVALID, STEERS)).isprintable()

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whatever messages the sensors send, each is read or refused with a remedy, and the pipeline stands."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from watched import CONFIGS, NUMBERS, Watched

from adhesion_node.core import Config
from adhesion_node.wire.line import FRAME, Line
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.topics import SENSORS
from adhesion_node.wire.track_line import line_of


def fields(name: str, value: Any) -> Any:
    """Return an object with a nested attribute, given by its path."""
    for part in reversed(name.split(".")):
        value = SimpleNamespace(**{part: value})
    return value


SENSED = {topic.name: topic for topic in SENSORS}

HEADERS = st.builds(
    lambda sec, nanosec, frame: SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id=frame),
    st.sampled_from([0, 1, 2, 3, 63, -(2**31), 2**31 - 1]) | st.integers(-(2**31), 2**31 - 1),
    st.sampled_from([0, 1, 5 * 10**8, 2**32 - 1]),
    st.sampled_from([FRAME, FRAME, FRAME, "", "map"]),
)
VARIANCES = NUMBERS | st.just(0.25)
POSES = st.builds(
    lambda x, variance: SimpleNamespace(pose=fields("position.x", x), covariance=[variance, *[0.0] * 35]),
    NUMBERS,
    VARIANCES,
)
TWISTS = st.builds(
    lambda x, variance: SimpleNamespace(twist=fields("linear.x", x), covariance=[variance, *[0.0] * 35]),
    NUMBERS,
    VARIANCES,
)
MERIDIAN = Line(track=line_of("a meridian", np.array([47.0, 47.1]), np.array([8.0, 8.0]), None, 0.0))
MESSAGES = st.one_of(
    st.tuples(
        st.sampled_from(["position", "odometry"]),
        st.builds(lambda h, pose: SimpleNamespace(header=h, pose=pose), HEADERS, POSES),
    ),
    st.tuples(
        st.just("fix"),
        st.builds(
            lambda h, latitude, longitude, spread, kind: SimpleNamespace(
                header=h,
                status=SimpleNamespace(status=0),
                latitude=latitude,
                longitude=longitude,
                position_covariance=spread,
                position_covariance_type=kind,
            ),
            HEADERS,
            NUMBERS | st.floats(46.99, 47.11),
            NUMBERS | st.floats(7.9999, 8.0001),
            st.lists(VARIANCES, min_size=9, max_size=9),
            st.integers(0, 3),
        ),
    ),
    st.tuples(
        st.just("imu"),
        st.builds(
            lambda h, along, spread: SimpleNamespace(
                header=h, linear_acceleration=SimpleNamespace(x=along), linear_acceleration_covariance=[spread] * 9
            ),
            HEADERS,
            NUMBERS,
            VARIANCES | st.just(-1.0),
        ),
    ),
    st.tuples(
        st.sampled_from(["brake_pressure", "brake_demand"]),
        st.builds(lambda h, p: SimpleNamespace(header=h, fluid_pressure=p), HEADERS, NUMBERS | st.just(511325.0)),
    ),
    st.tuples(
        st.just("speed"),
        st.builds(lambda h, twist: SimpleNamespace(header=h, twist=twist), HEADERS, TWISTS),
    ),
    st.tuples(
        st.just("traction_force"),
        st.builds(lambda h, f: SimpleNamespace(header=h, wrench=fields("force.x", f)), HEADERS, NUMBERS),
    ),
    st.tuples(
        st.just("wheel_speed"),
        st.builds(
            lambda h, names, velocities: SimpleNamespace(header=h, name=names, velocity=velocities),
            HEADERS,
            st.lists(st.text(max_size=3), max_size=3),
            st.lists(NUMBERS, max_size=3),
        ),
    ),
)


@given(config=CONFIGS, messages=st.lists(MESSAGES, max_size=25))
def test_any_messages_are_read_or_refused_with_a_remedy(config: Config, messages: list[tuple[str, Any]]) -> None:
    watched = Watched(config)
    for topic, message in messages:
        try:
            sample = SENSED[topic].read(message, MERIDIAN)
        except Rejected as refusal:
            watched.refuse(topic, refusal)
            continue
        if topic == "wheel_speed":
            assert sample.known_radps
        else:
            assert all(value is None or math.isfinite(value) for value in sample)
        if topic != "traction_force":
            watched.push(sample)
    watched.finish()

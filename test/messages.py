# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Messages of rclpy for tests, from plain numbers, by the codecs of the package."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.core.physics.train import GRAVITY
from adhesion_node.nodes.ros import types
from adhesion_node.nodes.ros.types import new
from adhesion_node.wire import topics
from adhesion_node.wire.messages import curves, parts, results
from adhesion_node.wire.topic import Topic
from sim_node.train.sensors import SensorMessage


def message_class(topic: Topic) -> type[Any]:
    return types.message_class(topic.type)


def header(t_ns: int) -> Any:
    return parts.header(new, t_ns)


def message_of(sent: SensorMessage) -> Any:
    return sent.build(new)


def position(t_ns: int, position_m: float, std_m: float) -> Any:
    return topics.POSITION.build(new, t_ns, (position_m,), std_m**2)


def brake_pressure(t_ns: int, absolute_pa: float, std_pa: float) -> Any:
    return topics.BRAKE_PRESSURE.build(new, t_ns, (absolute_pa,), std_pa**2)


def speed(t_ns: int, speed_mps: float, std_mps: float) -> Any:
    return topics.SPEED.build(new, t_ns, (speed_mps,), std_mps**2)


def wheel_speed(t_ns: int, speeds_radps: Sequence[float]) -> Any:
    return topics.WHEEL_SPEED.build(new, t_ns, speeds_radps)


def traction_force(t_ns: int, force_n: float) -> Any:
    return topics.TRACTION_FORCE.build(new, t_ns, (force_n,))


def clock(t_ns: int) -> Any:
    return topics.CLOCK.build(new, t_ns)


def mu_message(mu: float) -> Any:
    return topics.TRUTH_MU.build(new, mu)


def deceleration_message(t_ns: int, mu: float, mu_std: float) -> Any:
    along = new("geometry_msgs/msg/Accel", linear=parts.vector(new, -mu * GRAVITY))
    spread = parts.covariance((mu_std * GRAVITY) ** 2)
    accel = new("geometry_msgs/msg/AccelWithCovariance", accel=along, covariance=spread)
    return new(topics.DECELERATION.type, header=header(t_ns), accel=accel)


def state_message(t_ns: int, position_m: float, position_var: float, speed_mps: float, speed_var: float) -> Any:
    return new(topics.STATE.type, **results.write_state(new, t_ns, position_m, speed_mps, position_var, speed_var))


def curve_message(t_ns: int, braking: BrakingCurve, position_m: float) -> Any:
    return new(topics.BRAKING_CURVE.type, **curves.write_curve(new, t_ns, position_m, braking))

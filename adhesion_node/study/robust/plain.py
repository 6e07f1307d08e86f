# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""What a simulated sensor sends, as objects with the fields of its ROS message: `reading` needs no more, no ROS."""

from __future__ import annotations

from types import SimpleNamespace as Fields

from sim_node.train.messages import SensorMessage

from ...wire.codecs import NS
from ...wire.topics import BRAKE_PRESSURE, POSITION, SPEED


def plain(sent: SensorMessage) -> Fields:
    """Build the message."""
    seconds, nanoseconds = divmod(sent.t_ns, NS)
    message = Fields(header=Fields(frame_id=sent.frame, stamp=Fields(sec=seconds, nanosec=nanoseconds)))
    value = sent.values[0]
    if sent.topic == POSITION:
        message.pose = Fields(pose=Fields(position=Fields(x=value)), covariance=[sent.variance])
    elif sent.topic == BRAKE_PRESSURE:
        message.fluid_pressure = value
    elif sent.topic == SPEED:
        message.twist = Fields(twist=Fields(linear=Fields(x=value)))
    else:
        message.name = [f"axle_{number}" for number, _ in enumerate(sent.values, start=1)]
        message.velocity = sent.values
    return message

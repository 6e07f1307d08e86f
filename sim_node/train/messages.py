# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""What the sensors send, as plain data: a tick holds the truth of a sample and the messages that leave at its time."""

from __future__ import annotations

from typing import Any, NamedTuple

from adhesion_node.wire.codecs import FRAME, New
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION, SPEED, WHEEL_SPEED, Topic

from .plant import Truth
from .sensors import Reading, SensorSettings


class SensorMessage(NamedTuple):
    """One message: `values` in SI units, one for every axle group and else a single one."""

    topic: Topic
    t_ns: int
    values: tuple[float, ...]
    variance: float
    frame: str = FRAME

    def build(self, new: New) -> Any:
        """Build the message, with all that a fault has made of it."""
        return self.topic.build(new, self.t_ns, self.values, self.variance, self.frame)


Tick = tuple[Truth, tuple[SensorMessage, ...]]


def messages_of(reading: Reading, settings: SensorSettings) -> tuple[SensorMessage, ...]:
    """Return the messages of a reading in the order of publishing; the position completes the sample."""
    shown = (
        (BRAKE_PRESSURE, (reading.pressure_pa,), settings.pressure_std_pa),
        (SPEED, _single(reading.speed_mps), settings.speed_std_mps),
        (WHEEL_SPEED, reading.wheel_radps, settings.wheel_speed_std_radps),
        (POSITION, _single(reading.position_m), settings.position_std_m),
    )
    return tuple(
        SensorMessage(topic, reading.t_ns, values, std**2) for topic, values, std in shown if values is not None
    )


def _single(value: float | None) -> tuple[float, ...] | None:
    return None if value is None else (value,)

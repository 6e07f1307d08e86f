# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The way of a sample to an estimate of the creep curve, the same live and offline, and what it is set up with."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import fields
from functools import partial
from typing import Any, NamedTuple, final

from ..core.creep import estimator as creep
from ..core.creep.config import CreepConfig
from ..core.creep.estimator import CreepEstimate, CreepState
from ..core.creep.vehicle import Vehicle
from ..core.setting import check_value, settings_of
from ..wire.codecs import Line
from ..wire.settings import FRAME_ID, SENSOR_TIMEOUT, check_names
from ..wire.topics import WHEEL_SPEED
from .engine import EstimatorPipeline, Verbs

SETTINGS = (FRAME_ID, SENSOR_TIMEOUT, *settings_of(Vehicle), *settings_of(CreepConfig))
"""All settings of the creep estimator."""


class CreepSetup(NamedTuple):
    """What a creep estimator is set up with."""

    config: CreepConfig
    line: Line
    sensor_timeout_s: float
    """Silence of the wheel speeds after which /diagnostics says STALE; no result depends on it."""


def setup_of(values: Mapping[str, Any]) -> CreepSetup:
    """Build the set-up from values by setting name; what is not named keeps its default.

    Raises ValueError naming the setting when one is unknown, of a wrong type or out of range.
    """
    check_names(values, SETTINGS)
    of_the_node = (FRAME_ID, SENSOR_TIMEOUT)
    given = [values.get(own.name, own.default) for own in of_the_node]
    for own, value in zip(of_the_node, given, strict=True):
        check_value(own.name, value, type(own.default), own._asdict())
    vehicle = Vehicle(**_own(Vehicle, values))
    frame, timeout_s = given
    return CreepSetup(CreepConfig(vehicle=vehicle, **_own(CreepConfig, values)), Line(frame), timeout_s)


def _own(kind: type[Any], values: Mapping[str, Any]) -> dict[str, Any]:
    own = {item.name for item in fields(kind)}
    return {name: value for name, value in values.items() if name in own}


@final
class CreepPipeline(EstimatorPipeline[CreepState, CreepEstimate, CreepEstimate]):
    """From samples to estimates of the creep curve."""

    anchor = WHEEL_SPEED

    def __init__(self, config: CreepConfig) -> None:
        verbs = (creep.advance, creep.settle, creep.finish)
        super().__init__(Verbs(partial(creep.init, config), *(partial(verb, config) for verb in verbs)))
        self.config = config

    def _output(self, estimate: CreepEstimate) -> CreepEstimate:
        return estimate

    def stamp_ns(self, output: CreepEstimate) -> int:
        """When it was so."""
        return output.t_ns

    def _bytes(self, output: CreepEstimate) -> bytes:
        whole = struct.pack("<2q", output.t_ns, output.samples)
        reals = [value for value in output if isinstance(value, float)]
        return whole + struct.pack(f"<{len(reals)}d", *reals) + output.status.name.encode()

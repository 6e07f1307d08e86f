# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The way of a creep sample: paired, turned into creep and adhesion, identified; the same live and offline."""

from __future__ import annotations

import hashlib
import struct
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Any, NamedTuple

from ..core.creep.config import CreepConfig, CreepOutcome
from ..core.creep.curve import creep, used_adhesion
from ..core.creep.estimator import CreepEstimate, CreepSample, creep_step, init
from ..core.creep.inbox import CreepAligner, Paired, Sample
from ..core.setting import check_settings, check_value, setting, settings_of
from ..wire import codecs as reading
from ..wire.settings import FRAME_ID, SENSOR_TIMEOUT, check_names
from ..wire.topics import SPEED, TRACTION_FORCE, WHEEL_SPEED

UNPAIRED, SLOW, AXLES, UNEQUAL = "UNPAIRED", "SLOW", "AXLES", "UNEQUAL"
"""Why a wheel speed never became a creep: no speed or force of its time, a train too slow, another number of axles
than `axles`, or axles that creep so differently that their common force belongs to no one creep."""

UNEQUAL_SHARE, UNEQUAL_CREEP = 0.5, 0.005
"""The axles' creeps may differ by this share of their mean and this much."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """The traction unit, and how its sensors are paired. Raises ValueError naming the constant and its range."""

    axles: int = setting(6, "Driven axles", "", 1, 100)
    axle_load_kg: float = setting(25e3, "Mass on one driven axle, M", "kg", 1e3, 1e5)
    wheel_radius_m: float = setting(0.625, "Radius of a driven wheel, r", "m", 0.1, 5.0)
    min_speed_mps: float = setting(1.0, "Speed below which the creep is not formed", "m/s", 0.01, 100.0)
    wheel_std_radps: float = setting(0.003, "Noise of a wheel speed, standard deviation", "rad/s", 0.0, 10.0)
    speed_std_mps: float = setting(0.003, "Noise of the train's speed, standard deviation", "m/s", 0.0, 10.0)
    force_std_n: float = setting(2000.0, "Noise of the traction force, standard deviation", "N", 0.0, 1e6)
    pairing_wait_s: float = setting(
        0.2, "How long, by the stamps, a wheel speed waits for the speed and the force of its time", "s", 0.0, 60.0
    )
    pairing_age_s: float = setting(0.1, "Age from which a measured speed or force counts as none", "s", 1e-3, 60.0)

    def __post_init__(self) -> None:
        check_settings(self, "vehicle.")

    def creep_variance(self, mean_creep: float, speed_mps: float) -> float:
        """Variance of the mean creep by the noise of speed and wheel speeds, from the derivatives of (2)."""
        wheels = (self.wheel_radius_m * self.wheel_std_radps) ** 2 / self.axles
        return (((1.0 + mean_creep) * self.speed_std_mps) ** 2 + wheels) / speed_mps**2


SETTINGS = (FRAME_ID, SENSOR_TIMEOUT, *settings_of(Vehicle), *settings_of(CreepConfig))
"""All settings of the creep estimator."""

READERS: Mapping[str, Callable[[Any, str], Sample]] = MappingProxyType(
    {
        SPEED.name: reading.speed,
        TRACTION_FORCE.name: reading.traction_force,
        WHEEL_SPEED.name: reading.wheel_speed,
    }
)
"""How the messages of a sensor topic become samples."""


class CreepSetup(NamedTuple):
    """What a creep estimator is set up with."""

    config: CreepConfig
    vehicle: Vehicle
    frame: str
    """The frame_id that sensor messages must have."""
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
    return CreepSetup(_build(CreepConfig, values), _build(Vehicle, values), *given)


def _build(kind: type[Any], values: Mapping[str, Any]) -> Any:
    own = {item.name for item in fields(kind)}
    return kind(**{name: value for name, value in values.items() if name in own})


class CreepPipeline:
    """Pairs, forms the creep, steps the identification; counts what is dropped, digests what comes out. Mutable."""

    def __init__(self, config: CreepConfig, vehicle: Vehicle) -> None:
        self.config, self.vehicle = config, vehicle
        self.state = init(config)
        self.last: CreepEstimate | None = None
        self.dropped_early: Counter[str] = Counter()
        """Messages and pairs that never became a sample, by reason."""
        self._aligner = CreepAligner(vehicle.pairing_wait_s, vehicle.pairing_age_s)
        self._digest = hashlib.sha256()

    def push(self, sample: Sample) -> list[CreepEstimate]:
        """Take one sample of any stream and return the estimates that it completes."""
        return self._run(self._aligner.push(sample))

    def finish(self) -> list[CreepEstimate]:
        """End of the data: use what still waits; call once."""
        return self._run(self._aligner.flush())

    def refuse(self, reason: str) -> None:
        """Count a message that never became a sample."""
        self.dropped_early[reason] += 1

    @property
    def accepted(self) -> int:
        """Samples that the identification used."""
        return self.state.counts[CreepOutcome.ACCEPTED]

    @property
    def dropped(self) -> dict[str, int]:
        """Numbers of what was not used, by reason; reasons that did not occur are left out."""
        unused = (CreepOutcome.LATE, CreepOutcome.DUPLICATE, CreepOutcome.INVALID, CreepOutcome.IDLE)
        counts = self.dropped_early + Counter({outcome.name: self.state.counts[outcome] for outcome in unused})
        return {reason: count for reason, count in sorted(counts.items()) if count}

    @property
    def digest(self) -> str:
        """SHA-256 over every number of every estimate so far."""
        return self._digest.hexdigest()

    def _run(self, pairs: Iterable[Paired]) -> list[CreepEstimate]:
        estimates = []
        for pair in pairs:
            sample = self._sample(pair)
            if isinstance(sample, str):
                self.refuse(sample)
                continue
            self.state, estimate = creep_step(self.config, self.state, sample)
            if estimate is not None:
                self.last = estimate
                self._digest.update(_bytes(estimate))
                estimates.append(estimate)
        return estimates

    def _sample(self, pair: Paired) -> CreepSample | str:
        """Form creep (2), the mean over the axles, and adhesion (3), or say why that cannot be."""
        vehicle = self.vehicle
        if pair.speed_mps is None or pair.force_n is None:
            return UNPAIRED
        if len(pair.speeds_radps) != vehicle.axles:
            return AXLES
        speed = pair.speed_mps
        if speed < vehicle.min_speed_mps:
            return SLOW
        creeps = [creep(wheel, speed, vehicle.wheel_radius_m) for wheel in pair.speeds_radps]
        mean = sum(creeps) / vehicle.axles
        if max(creeps) - min(creeps) > UNEQUAL_SHARE * abs(mean) + UNEQUAL_CREEP:
            return UNEQUAL
        load_kg = vehicle.axles * vehicle.axle_load_kg
        return CreepSample(
            pair.t_ns,
            mean,
            used_adhesion(pair.force_n, load_kg),
            vehicle.creep_variance(mean, speed),
            used_adhesion(vehicle.force_std_n, load_kg) ** 2,
        )


def _bytes(estimate: CreepEstimate) -> bytes:
    """Every number of an estimate, little-endian: integers as 8 bytes, floats as doubles."""
    whole = struct.pack("<2q", estimate.t_ns, estimate.samples)
    reals = [value for value in estimate if isinstance(value, float)]
    return whole + struct.pack(f"<{len(reals)}d", *reals) + estimate.status.name.encode()

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Worlds drawn at random: trains, rails, brakings and sensors, wider than the scenarios and the sets by name.

A seed is a world. Its train, rail and braking are the same whatever sensors are asked for.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from adhesion_node.wire.topics import BRAKE_DEMAND

from .plant.journey import GRAVITY
from .plant.scenarios import Scenario
from .plant.train import Nominal
from .plant.way import LEVEL, Grade, Rail, along, patches, steady, undulating
from .sensors.fitted import Fitted, Mounted
from .sensors.imu import Imu
from .sensors.position import Gnss, TachoPosition
from .sensors.pressure import CYLINDER, DEMANDED, MEAN, Pressure
from .sensors.speed import Speedometer
from .sensors.timing import NEVER, Spells, Timing
from .sensors.wheels import Wheels

LEAST_MU0, MOST_MU0 = 0.025, 0.3
"""Range of a rail's level, even in its logarithm: leaves to dry."""

BEFORE = 0.12
"""Part of its speed that a train loses at most by each braking before the full one."""

WAY_M = 30e3

Some = TypeVar("Some")
Named = tuple[str, Mounted]


class World(NamedTuple):
    """A train on its rail, and what it is fitted with."""

    scenario: Scenario
    fitted: Fitted


def world(sensors: str, seed: int) -> World:
    """Draw a world with sensors as one of `SENSORS` says."""
    return World(_scenario(seed), _fitted(sensors, np.random.default_rng([seed, *sensors.encode()])))


def _scenario(seed: int) -> Scenario:
    rng = np.random.default_rng([seed, *b"scenario"])
    nominal, speed_mps, (grade, known) = _nominal(rng), rng.uniform(12.0, 60.0), _grade(rng)
    demands = _demands(nominal.deceleration_mps2, speed_mps, rng)
    return Scenario(f"drawn {seed}", nominal, speed_mps, _rail(rng), demands, grade, known, way_m=WAY_M)


def _fitted(sensors: str, rng: np.random.Generator) -> Fitted:
    return Fitted(sensors, dict([*(draw(rng) for draw in SENSORS[sensors]), *_brake(rng)]))


def _nominal(rng: np.random.Generator) -> Nominal:
    """A train with slide protection, from a tram to two coupled units."""
    length_m = _between(25.0, 400.0, rng)
    mass_kg = length_m * rng.uniform(1.5e3, 3.0e3)
    resistance = (
        mass_kg * GRAVITY * rng.uniform(0.8e-3, 1.8e-3),
        length_m * rng.uniform(0.3, 0.7),
        (1.0 + 0.035 * length_m) * rng.uniform(0.8, 1.2),
    )
    return Nominal(
        "drawn",
        groups=int(np.clip(length_m / rng.uniform(5.0, 14.0), 4, 24)),
        mass_kg=mass_kg,
        length_m=length_m,
        resistance=resistance,
        deceleration_mps2=rng.uniform(0.8, 1.3),
        rotating=rng.uniform(0.03, 0.08),
        wheel_radius_m=rng.uniform(0.3, 0.5),
        full_pa=rng.uniform(250e3, 450e3),
        build_up_s=rng.uniform(1.0, 4.0),
        propagation_mps=_one_of((np.inf, np.inf, np.inf, 250.0), rng),
        protection_creep=_between(0.5, 2.5, rng),
    )


def _rail(rng: np.random.Generator) -> Rail:
    """One level, one that rises or falls by up to a tenth in a kilometre, patches, or a fall."""
    level, other = (_between(LEAST_MU0, MOST_MU0, rng) for _ in range(2))
    falls_m, length_m, lost = rng.uniform(200.0, 1500.0), rng.uniform(1.0, 300.0), rng.uniform(0.3, 0.75)
    changes = 1.0 + rng.uniform(-0.1, 0.1)
    levels = (
        steady(level),
        steady(level),
        along(*((1e3 * km, max(level * changes**km, LEAST_MU0)) for km in range(round(WAY_M / 1e3)))),
        patches(level, other, (200.0, 1000.0), (100.0, 800.0)),
        along((falls_m, level), (falls_m + length_m, max(lost * level, LEAST_MU0))),
    )
    cleaning, roughness = rng.uniform(1.0, 1.5), rng.uniform(0.02, 0.08)
    return Rail(_one_of(levels, rng), cleaning, level_std=0.0, roughness=roughness)


def _grade(rng: np.random.Generator) -> tuple[Grade, tuple[tuple[float, float, float], ...]]:
    """Level, one slope that is told, or waves that are not."""
    slope, waves = rng.uniform(-0.01, 0.01), rng.uniform(0.001, 0.01)
    told = ((-1000.0, 2.0 * WAY_M, slope),)
    grades = (LEVEL, ()), (LEVEL, ()), (steady(slope), told), (undulating(waves), ())
    return _one_of(grades, rng)


def _demands(deceleration_mps2: float, speed_mps: float, rng: np.random.Generator) -> tuple[tuple[float, float], ...]:
    """Up to three brakings by a part of the brake, released or not, and the full one."""
    at_s, demands = rng.uniform(20.0, 60.0), list[tuple[float, float]]()
    for _ in range(rng.integers(4)):
        share = rng.uniform(0.15, 0.8)
        demands.append((at_s, share))
        at_s += min(rng.uniform(3.0, 12.0), BEFORE * speed_mps / (share * deceleration_mps2))
        if rng.random() < 0.6:
            demands.append((at_s, 0.0))
            at_s += rng.uniform(2.0, 12.0)
    return *demands, (at_s, 1.0)


def _receiver(rng: np.random.Generator) -> Named:
    declared = _one_of((1.0, 1.0, 1.0, 2.0, 0.5, 0.0), rng)
    sensor = Gnss(rng.uniform(0.5, 3.0), _between(10.0, 200.0, rng), _between(0.05, 0.5, rng), declared)
    outages = _one_of((NEVER, NEVER, NEVER, Spells(rng.uniform(15.0, 60.0), 2.0, 20.0)), rng)
    late_s = rng.uniform(0.02, 0.3)
    return "position", Mounted(sensor, Timing(_rate(rng, 1.0), late_s, 0.1, outages=outages), "receiver")


def _odometer(rng: np.random.Generator) -> Named:
    sensor = TachoPosition(int(rng.integers(4)), _between(0.01, 0.5, rng), rng.uniform(0.2, 2.0))
    return "tacho", Mounted(sensor, Timing(_rate(rng)), "tacho")


def _wheels(rng: np.random.Generator) -> Named:
    heard = _one_of(((0.0, 1.0), (0.0, 1.0), (0.0, 1.0), (0.3, 0.7)), rng)
    sensor = Wheels(rng.uniform(0.001, 0.005), rng.uniform(0.005, 0.05), heard=heard)
    return "wheels", Mounted(sensor, Timing(_rate(rng)), "slide protection")


def _speed(rng: np.random.Generator) -> Named:
    """A receiver's own, or a radar's, whose scale is wrong."""
    name, scale_std = _one_of((("speed doppler", 0.0), ("speed doppler", 0.0), ("speed radar", 0.01)), rng)
    white, slow, lasts_s = rng.uniform(0.02, 0.1), rng.uniform(0.0, 0.1), rng.uniform(1.0, 10.0)
    sensor = Speedometer(white, slow, lasts_s, scale_std, _one_of((1.0, 1.0, 0.5, 0.0), rng))
    return name, Mounted(sensor, Timing(_rate(rng, 1.0), rng.uniform(0.02, 0.2)), "speedometer")


def _accelerometer(rng: np.random.Generator) -> Named:
    sensor = Imu(rng.uniform(0.0, 0.05), 0.0005, rng.uniform(0.02, 0.1), rng.uniform(0.0, 0.006))
    return "imu", Mounted(sensor, Timing(_one_of((20.0, 50.0, 100.0), rng)), "imu")


def _brake(rng: np.random.Generator) -> list[Named]:
    """What is demanded, the mean of the cylinders or one of them, and with these the handle or not."""
    of, timing = _one_of((DEMANDED, DEMANDED, MEAN, CYLINDER), rng), Timing(_rate(rng))
    gauge = f"pressure {of}", Mounted(Pressure(of, int(rng.integers(4))), timing, "brake")
    handle = "handle", Mounted(Pressure(DEMANDED, topic=BRAKE_DEMAND), timing, "handle")
    return [gauge, handle] if of != DEMANDED and rng.random() < 0.5 else [gauge]


def _rate(rng: np.random.Generator, *slower: float) -> float:
    """Measurements a second."""
    return _one_of((*slower, 2.0, 5.0, 10.0), rng)


def _between(low: float, high: float, rng: np.random.Generator) -> float:
    """Even in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _one_of(some: Sequence[Some], rng: np.random.Generator) -> Some:
    """As likely each."""
    return some[int(rng.integers(len(some)))]


SENSORS: Mapping[str, tuple[Callable[[np.random.Generator], Named], ...]] = {
    "receiver": (_receiver,),
    "receiver+wheels": (_receiver, _wheels),
    "receiver+speed": (_receiver, _speed),
    "receiver+accelerometer": (_receiver, _accelerometer),
    "receiver+wheels+speed+accelerometer": (_receiver, _wheels, _speed, _accelerometer),
    "speed": (_speed,),
    "speed+wheels": (_speed, _wheels),
    "odometer": (_odometer,),
    "odometer+wheels": (_odometer, _wheels),
}
"""What a train may be fitted with beside gauges of its brake, by name."""

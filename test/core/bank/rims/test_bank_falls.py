# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Wheels that slide all at once, or while nothing tells of a brake: they are not the train's speed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from banks import FULL_PA, S

from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.gear.fastest import UNISON_S, Fastest
from adhesion_node.core.bank.gear.slides import FALLS
from adhesion_node.core.bank.gear.wheels import WheelsSeen
from adhesion_node.core.bank.layout import MU, SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import Measurement, WheelSample

CONFIG = Config(method="bank")
AXLES, CRUISE_S, SLOWING = 8, 20.0, 0.3
RAIL = Rail(0.05, 0.04, 0.02)


Gauge = tuple[float, float, float | None]


def journey(
    seconds: float,
    sensor: str,
    gauge: tuple[float, float, float | None],
    seed: int = 1,
    config: Config = CONFIG,
    gained_mps2: float = 0.0,
) -> tuple[Memory, float]:
    """20 s up to 40 m/s at such an acceleration, then the full brake on a rail of 0.03.

    All axles fall to 0.7 of the train's speed there.
    `gauge` is from when to when, behind the brake's begin, the pressure is shown as the third. The memory, and how fast
    the train is.
    """
    rng, speed, place = np.random.default_rng(seed), 40.0 - gained_mps2 * CRUISE_S, 0.0
    memory: Memory | None = None
    begin_s, end_s, shown = gauge
    for tick in range(round(10.0 * (CRUISE_S + seconds))):
        braked_s = 0.1 * tick - CRUISE_S
        pressed = FULL_PA * min(max(braked_s, 0.0), 1.0)
        rims = speed * (1.0 - 0.3 * min(max(braked_s - 1.0, 0.0), 1.0)) * (1.0 + 0.001 * rng.standard_normal(AXLES))
        t_ns = S + tick * S // 10
        pressure = shown if begin_s <= braked_s < end_s else pressed
        measured = Measurement(t_ns, place + 0.3 * rng.standard_normal(), 0.09, pressure)
        if sensor == "wheels":
            rates = tuple((rims / CONFIG.train.wheel_radius_m).tolist())
            measured = measured._replace(wheels=(WheelSample(t_ns, rates),))
        else:
            measured = measured._replace(speed_mps=float(rims[0]))
        memory = met(config, measured) if memory is None else followed(config, memory, measured, lambda: RAIL)
        slowing = SLOWING * min(max(braked_s, 0.0), 1.0) - (gained_mps2 if braked_s < 0.0 else 0.0)
        place, speed = place + 0.1 * speed, speed - 0.1 * slowing
    assert memory is not None
    return memory, speed


@pytest.mark.parametrize("sensor", ["wheels", "axle"])
@pytest.mark.parametrize(
    "gauge",
    [(4.0, 10.0, None), (-math.inf, math.inf, None), (6.0, 7.5, None)],
    ids=["lost for 6 s", "never known", "lost for 1.5 s"],
)
@pytest.mark.parametrize("seconds", [9.0, 14.0])
def test_wheels_that_slide_are_not_the_speed_where_no_pressure_is_known(
    sensor: str, gauge: Gauge, seconds: float
) -> None:
    memory, speed = journey(seconds, sensor, gauge)
    mean, covariance = memory.bank.moments(2)
    assert mean[SPEED] == pytest.approx(speed, abs=4.0 * math.sqrt(covariance[SPEED, SPEED]))
    assert mean[SPEED] == pytest.approx(speed, abs=1.0)


@pytest.mark.parametrize("gained_mps2", [0.0, 0.5])
@pytest.mark.parametrize("seconds", [3.0, 9.0, 14.0])
def test_wheels_that_all_fall_slide_though_an_isolated_cylinder_says_that_no_brake_is_applied(
    seconds: float, gained_mps2: float
) -> None:
    """Out of traction, too: a slide that begins is no spin that ends."""
    memory, speed = journey(seconds, "wheels", (-math.inf, math.inf, 0.0), gained_mps2=gained_mps2)
    assert not memory.braked
    assert memory.bank.mean_of(SPEED) == pytest.approx(speed, abs=1.0)


@pytest.mark.parametrize(("every", "most_mps", "gained_mps2"), [(3, 6.0, 0.0), (2, 12.0, 0.25)])
def test_driven_axles_that_spin_and_grip_again_are_no_slide_of_all(
    every: int, most_mps: float, gained_mps2: float
) -> None:
    """A third or a half of the axles spins up to so much faster than the train, and falls back within half a second.

    With a half of them the middle rim fell: wheels were not believed for 2 min, or until all agreed.
    """
    memory: Memory | None = None
    place, speed = 0.0, 20.0
    for tick in range(300):
        t_ns, spin = (
            S + tick * S // 10,
            most_mps * min(max(0.1 * (tick - 250), 0.0), max(2.0 * (25.8 - 0.1 * tick), 0.0), 1.0),
        )
        speeds = speed + np.where(np.arange(AXLES) % every == 0, spin, 0.0)
        sample = WheelSample(t_ns, tuple((speeds / CONFIG.train.wheel_radius_m).tolist()))
        measured = Measurement(t_ns, place, 0.09, 0.0, wheels=(sample,))
        memory = met(CONFIG, measured) if memory is None else followed(CONFIG, memory, measured, lambda: RAIL)
        assert memory.wheels.fastest.fell_ns is None
        place, speed = place + 0.1 * speed, speed + 0.1 * gained_mps2
    assert memory is not None
    assert memory.bank.mean_of(SPEED) == pytest.approx(speed, abs=0.1)


def test_a_train_without_a_pressure_is_followed_by_its_axle_where_that_is_all() -> None:
    memory = met(CONFIG, Measurement(S, 0.0, math.inf, None, 30.0))
    for tick in range(1, 50):
        measured = Measurement(S + tick * S // 10, 0.0, math.inf, None, 30.0 - 0.05 * tick)
        memory = followed(CONFIG, memory, measured, lambda: RAIL)
    assert memory.bank.mean_of(SPEED) == pytest.approx(27.5, abs=0.3)


def test_where_all_axles_have_fallen_a_rail_that_gives_much_less_is_thought_of_at_once() -> None:
    """Deep slides use less than half of what the wheels used that still rolled."""
    memory, _ = journey(2.5, "wheels", (math.inf, math.inf, None))
    assert memory.braking.told == FALLS
    low = memory.bank.mean[:, MU] < 0.5 * memory.braking.applied
    assert float(memory.bank.weight @ low) > 0.1


def test_how_fast_all_axles_fall_tells_how_little_the_rail_gives() -> None:
    """They fall by 12 m/s^2: the brake needs half of its force for that, and no more than the rest is used."""
    turning = replace(CONFIG, train=replace(CONFIG.train, rotating_mass_fraction=0.045))
    for seed in range(4):
        (memory, _), (blind, _) = (
            journey(2.5, "wheels", (math.inf, math.inf, None), seed, config) for config in (turning, CONFIG)
        )
        brake = memory.braking.applied
        much, before = (float(each.bank.weight @ (each.bank.mean[:, MU] > 0.75 * brake)) for each in (memory, blind))
        assert much < 0.5 * before


def rims(speeds: list[float], noise: float = 1e-6) -> Fastest:
    """The fastest rim at 10 Hz."""
    fastest = Fastest(trusted_ns=10**6 * S)
    for tick, speed in enumerate(speeds):
        fastest = fastest.after(speed, noise, S + tick * S // 10)
    return fastest


def test_a_fall_is_one_beyond_what_brakes_and_noise_explain() -> None:
    now_ns = S + 5 * S // 10
    assert not rims([40.0 - 0.2 * tick for tick in range(6)]).fell(now_ns)  # 2 m/s^2
    assert rims([40.0 - 0.5 * tick for tick in range(6)]).fell(now_ns)
    assert not rims([40.0 - 0.5 * tick for tick in range(6)], noise=1e-3).fell(now_ns)
    assert not rims([40.0 - 0.5 * tick for tick in range(6)]).fell(now_ns + 2 * S)


def test_a_fall_is_told_anew_only_as_it_is_deeper_than_all_before() -> None:
    fallen, later = [40.0 - 0.8 * tick for tick in range(8)], [40.0] * 10
    deeper = [40.0 - 1.6 * tick for tick in range(8)]
    first = rims(fallen).fall_mps2
    assert first == pytest.approx(8.0, rel=0.01)
    assert rims(fallen + later + fallen).fall_mps2 == first
    assert rims(fallen + later + deeper).fall_mps2 > 1.3 * first


def test_behind_a_fall_a_rim_is_trusted_once_it_rises_no_more() -> None:
    fallen = [40.0 - 0.8 * tick for tick in range(10)]
    rising = [fallen[-1] + 0.5 * tick for tick in range(1, 9)]
    trusted = 1e-9 * (rims(fallen)).trusted_ns
    assert trusted >= 1.0 + 0.9 + UNISON_S
    assert not rims(fallen + rising).risen
    rolled = rims([*fallen, *rising, *(36.8 - 0.02 * tick for tick in range(6))])
    assert rolled.risen
    assert rolled.trusted_ns < 10**6 * S
    assert not rims([*fallen, *rising, *(36.8 - 0.8 * tick for tick in range(6))]).risen


def test_a_slide_is_no_noise_of_the_wheels() -> None:
    wheels = WheelsSeen()
    config = replace(CONFIG, sliding_creep=0.03)
    for tick in range(200):
        speeds = np.full(AXLES, 40.0) * (0.8 if 100 <= tick < 110 else 1.0) ** np.arange(AXLES)
        sample = WheelSample(S + tick * S // 10, tuple((speeds / config.train.wheel_radius_m).tolist()))
        wheels = wheels.after(config, sample, 40.0, 0.1, False)
        if tick == 110:
            assert math.sqrt(wheels.radii.noise) < 0.01

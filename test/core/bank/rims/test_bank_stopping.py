# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train whose speed is badly known under the brake: when its wheels show that it stands, and when they do not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from banks import FULL_PA, S

from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.gear.halting import Halting
from adhesion_node.core.bank.layout import SPEED
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import Measurement, PressureSample, WheelSample
from adhesion_node.core.physics.train import Array

CYLINDER, MEAN, DEMANDED = (Config(method="bank", pressure_kind=kind) for kind in ("cylinder", "mean", "demanded"))
RAIL = Rail(0.05, 0.04, 0.02)
AXLES, AWAY_S, LEAVES_S = 4, 20.0, 8.0


def braked(seed: int, behind: str, gauge: str, until_s: float = 40.0) -> Array:
    """What is told, 20 s at 20 m/s, then by wheels alone: time, s, speed, its error and standard deviation, m/s.

    The full brake meets leaves, 0.03, on which slide protection lets each axle fall to 6 to 16 % of creep in turns.
    `behind` 8 s of them they are "wet", 0.08, or "dry", or all axles "lock", or fall as a train does that is braked
    in full ("follow"), as their protection does with too low a speed to refer to. A `gauge` of cylinders shows what
    presses then; of "none" the demand alone is heard.
    """
    rng, speed, place = np.random.default_rng(seed), 20.0, 0.0
    rims, falls, depth = np.full(AXLES, 20.0), np.full(AXLES, fill_value=True), rng.uniform(0.06, 0.16, AXLES)
    memory, told = None, list[tuple[float, ...]]()
    config = {"mean": MEAN, "demanded": DEMANDED, "none": CYLINDER}[gauge]
    for tick in range(round(10.0 * (AWAY_S + until_s))):
        t_ns, since_s = S + tick * S // 10, 0.1 * tick - AWAY_S
        leaves = since_s < LEAVES_S
        mu = 0.03 if leaves or behind in ("lock", "follow") else 0.08 if behind == "wet" else 0.2
        asked = 0.092 * min(max(since_s, 0.0) / 2.0, 1.0)
        used = min(asked, mu)
        if since_s < 1.0 or (behind == "dry" and not leaves):
            rims = np.minimum(rims + 0.6, speed)
        elif behind == "lock" and not leaves:
            rims = np.maximum(rims - 1.0, 0.0)
        elif behind == "follow" and not leaves:
            rims = np.maximum(np.full(AXLES, rims.max()) - 0.09, 0.0)
        else:
            creep = 1.0 - rims / max(speed, 0.5)
            falls = np.where(falls, creep < depth, creep < 0.02)
            rims = np.clip(rims + np.where(falls, -0.5, 0.3), 0.0, speed) if speed > 1.4 else np.maximum(rims - 0.4, 0)
        rates = np.maximum(rims * (1.0 + 0.001 * rng.standard_normal(AXLES)), 0.0) / config.train.wheel_radius_m
        pressed = FULL_PA * (used if gauge == "mean" else asked) / 0.092 * (1.0 + 0.1 * float(rng.standard_normal()))
        pressure = PressureSample(t_ns, min(pressed, FULL_PA) if gauge == "mean" else FULL_PA * asked / 0.092)
        variance_m2 = 1.0 if since_s < 0.0 else np.inf
        seen = place + 0.3 * float(rng.standard_normal())
        wheels = (WheelSample(t_ns, tuple(rates.tolist())),)
        measured = Measurement(t_ns, seen, variance_m2, pressure.pressure_pa, wheels=wheels, pressures=(pressure,))
        if gauge == "none":
            measured = Measurement(t_ns, seen, variance_m2, wheels=wheels, demand_pa=pressure.pressure_pa)
        memory = met(config, measured) if memory is None else followed(config, memory, measured, lambda: RAIL)
        told.append((since_s, speed, memory.bank.mean_of(SPEED) - speed, memory.bank.std_of(SPEED)))
        place, speed = place + 0.1 * speed, max(speed - 0.98 * used, 0.0)
    return np.array(told)[round(10.0 * AWAY_S) :]


@pytest.mark.parametrize("behind", ["wet", "dry"])
def test_a_train_that_stops_behind_leaves_is_told_to_stand(behind: str) -> None:
    """Its wheels were not believed, as they seemed to slide the more: it was told as 8 to 11 m/s for half a minute."""
    for seed in range(2):
        time_s, speed, error, _ = braked(seed, behind, "mean").T
        stands = time_s > time_s[speed == 0.0][0] + 2.0
        assert np.max(np.abs(error[stands])) < 0.5


@pytest.mark.parametrize("behind", ["lock", "follow"])
@pytest.mark.parametrize("gauge", ["mean", "demanded", "none"])
def test_wheels_that_all_lock_do_not_stop_the_train(behind: str, gauge: str) -> None:
    """However gently: where protection refers to them all the cylinders press with less, or none tells of them."""
    for seed in range(2):
        _, _, error, std = braked(seed, behind, gauge, 30.0).T
        assert np.min(error / std) > -2.0
        assert np.max(np.abs(error)) < 2.0


def seen(speeds: Sequence[tuple[float, ...]], asked_mps2: float = 1.0) -> Halting:
    """Rims at 10 Hz."""
    halting = Halting()
    for tick, rims in enumerate(speeds):
        halting = halting.after(rims, S + tick * S // 10, asked_mps2)
    return halting


@pytest.mark.parametrize(("slowing", "asked_mps2", "stands"), [(0.9, 1.0, True), (1.5, 1.0, False), (0.9, 0.3, False)])
def test_a_fastest_rim_that_comes_down_as_a_train_does_shows_a_standstill(
    slowing: float, asked_mps2: float, stands: bool
) -> None:
    course = [max(8.0 - 0.1 * slowing * tick, 0.0) for tick in range(120)]
    assert not seen([(rim, rim, rim) for rim in course[:50]], asked_mps2).stands(1.0)
    assert seen([(rim, rim, rim) for rim in course], asked_mps2).stands(1.0) is stands
    assert not seen([(rim, rim) for rim in course], asked_mps2).stands(1.0)
    again = [*course, 2.0, 0.0]
    assert not seen([(rim, rim, rim) for rim in again], asked_mps2).stands(1.0)


def test_rims_that_were_silent_or_few_do_not_show_a_standstill() -> None:
    """They may have locked meanwhile: a train that ran at 21 m/s was told to stand."""
    rolled = [(20.0,) * 4] * 10
    silent = seen(rolled).after((0.0,) * 4, S + 70 * S // 10, 1.0)
    assert not silent.after((0.0,) * 4, S + 71 * S // 10, 1.0).stands(1.0)
    assert not seen([*rolled, *[(4.0,)] * 60, *[(0.0,)] * 20]).stands(1.0)
    assert not seen([*rolled, *[(4.0,)] * 60, *[(0.0,) * 4] * 20]).stands(1.0)


@pytest.mark.parametrize(("creep", "least_mps"), [(0.05, -0.8), (0.2, -0.3)])
def test_wheels_that_all_creep_alike_are_not_the_speed_where_positions_tell_it(creep: float, least_mps: float) -> None:
    """Their cylinders press as the rail allows, so that they slow down as rims do that roll."""
    rng, speed, place, off = np.random.default_rng(1), 25.0, 0.0, list[float]()
    memory = None
    for tick in range(500):
        since_s, t_ns = 0.1 * tick - AWAY_S, S + tick * S // 10
        used = min(0.046 * max(since_s, 0.0), 0.05)
        rims = speed * (1.0 - creep * min(max(since_s - 1.0, 0.0), 1.0)) * (1.0 + 0.001 * rng.standard_normal(8))
        wheels = (WheelSample(t_ns, tuple((rims / MEAN.train.wheel_radius_m).tolist())),)
        pressure, seen_m = PressureSample(t_ns, FULL_PA * used / 0.092), place + 0.3 * float(rng.standard_normal())
        measured = Measurement(t_ns, seen_m, 1.0, pressure.pressure_pa, wheels=wheels, pressures=(pressure,))
        memory = met(MEAN, measured) if memory is None else followed(MEAN, memory, measured, lambda: RAIL)
        off += [memory.bank.mean_of(SPEED) - speed] if since_s > 0.0 else []
        place, speed = place + 0.1 * speed, speed - 0.98 * used
    assert min(off) > least_mps

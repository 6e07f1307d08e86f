# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the fastest rim's own course tells of its errors, and a train all of whose axles creep."""

from __future__ import annotations

import math

import numpy as np
import pytest
from banks import FULL_PA, S
from scipy.signal import lfilter

from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.gear.axles import ROLLS
from adhesion_node.core.bank.gear.wander import LASTING, LEAST, QUICK, Errors, Wander
from adhesion_node.core.bank.layout import SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import Measurement, WheelSample
from adhesion_node.core.physics.train import Array

CONFIG = Config(method="bank")
RAIL = Rail(0.05, 0.04, 0.02)


def wandering(count: int, lasts: float, std: float, rng: np.random.Generator) -> Array:
    """Errors of such a standard deviation, of which each keeps the share `lasts` of the one before."""
    return np.asarray(lfilter([std * math.sqrt(1.0 - lasts**2)], [1.0, -lasts], rng.standard_normal(count + 100))[100:])


def shown(errors: Array, slowing: float = 0.8) -> Errors:
    """Of a rim that is taken twice a second while the train slows so, ever more gently."""
    times = 0.5 * np.arange(errors.size)
    speeds = (40.0 - slowing * times + 0.005 * slowing * times**2) * (1.0 + errors)
    wander = Wander()
    for time_s, speed in zip(times.tolist(), speeds.tolist(), strict=True):
        wander = wander.after(S + round(time_s * S), speed)
    return wander.errors()


@pytest.mark.parametrize("std", [0.0, 0.0005])
@pytest.mark.parametrize("slowing", [0.0, 0.3, 1.2])
def test_a_rim_that_rolls_shows_hardly_any_error_however_the_train_slows(std: float, slowing: float) -> None:
    errors = shown(std * np.random.default_rng(1).standard_normal(40), slowing)
    assert errors.quick == LEAST
    assert errors.lasting < LASTING * std**2 + 1e-12


def test_errors_of_each_sample_and_such_as_last_are_told_apart() -> None:
    """In the mean over 40 runs; of what lasts a parabola over 12 s takes a part."""
    rng = np.random.default_rng(2)
    quick = [shown(0.003 * rng.standard_normal(60)) for _ in range(40)]
    lasting = [shown(wandering(60, 0.9, 0.01, rng)) for _ in range(40)]
    assert np.mean([each.quick for each in quick]) == pytest.approx(math.sqrt(QUICK) * 0.003, rel=0.15)
    assert np.mean([each.lasting for each in quick]) < 0.1 * np.mean([each.lasting for each in lasting])
    assert np.mean([each.lasting for each in lasting]) == pytest.approx(LASTING * 0.01**2 * 0.12, rel=0.5)


def test_until_enough_is_seen_and_of_what_is_old_nothing_is_told() -> None:
    few = shown(wandering(15, 0.9, 0.01, np.random.default_rng(3)))
    assert few == Errors(ROLLS, 0.0)
    calm = np.concatenate((wandering(40, 0.9, 0.01, np.random.default_rng(3)), np.zeros(30)))
    assert shown(calm) == pytest.approx(Errors(LEAST, 0.0), abs=1e-12)


Held = tuple[float, float]


def deviations(
    seed: int, held: Held = (0.035, 0.01), brakes: float = 40.0, rolls: float = 0.0, dark: bool = False
) -> Array:
    """Speeds, m/s, their errors and standard deviations: 20 s at 40 m/s, then a wet rail on which all axles creep.

    Their protection holds each at some creep: the fastest at the mean of `held` in which it wanders within some seconds
    by so much, each other one by a hundredth more. Positions err by 1 m; `dark`: there are none under the brake. In the
    end the brake is released for `rolls` seconds. From 4 s behind the begin of the brake on.
    """
    rng, speed, place, (mean_creep, std) = np.random.default_rng(seed), 40.0, 0.0, held
    creep = mean_creep + wandering(round(10.0 * brakes), 0.98, std, rng)
    offset = wandering(round(10.0 * (20.0 + brakes + rolls)), 0.997, 1.0, rng)
    memory: Memory | None = None
    told: list[tuple[float, float, float]] = []
    for tick in range(offset.size):
        braked_s = 0.1 * tick - 20.0
        slides = 2.0 < braked_s < brakes + 1.0
        slid = float(max(creep[min(max(tick - 200, 0), creep.size - 1)], 0.005)) if slides else 0.0
        behind = np.array([0.0, 0.01, 0.02, 0.03, 0.04, 0.05]) * slides
        rims = speed * (1.0 - slid - behind) * (1.0 + 0.0005 * rng.standard_normal(6))
        t_ns = S + tick * S // 10
        wheels = (WheelSample(t_ns, tuple((rims / CONFIG.train.wheel_radius_m).tolist())),)
        seen = place + offset[tick] + 0.1 * rng.standard_normal()
        applied = min(max(braked_s, 0.0), 1.0) * (1.0 - min(max(braked_s - brakes, 0.0), 1.0))
        variance = math.inf if dark and braked_s > 0.0 else 1.0
        measured = Measurement(t_ns, seen, variance, FULL_PA * applied, wheels=wheels)
        memory = met(CONFIG, measured) if memory is None else followed(CONFIG, memory, measured, lambda: RAIL)
        mean, covariance = memory.bank.moments(2)
        told += [(speed, mean[SPEED] - speed, math.sqrt(covariance[SPEED, SPEED]))] if braked_s > 4.0 else []
        place, speed = place + 0.1 * speed, speed - 0.1 * 0.75 * applied
    return np.array(told).T


def test_the_speed_of_a_train_all_of_whose_axles_creep_is_as_sure_as_it_says() -> None:
    """Believed as errors that do not last, 16 % of these speeds lay beyond 3 standard deviations."""
    _, errors, stds = np.hstack([deviations(seed) for seed in range(12)])
    assert np.mean(np.abs(errors) > 3.0 * stds) < 0.02
    assert math.sqrt(np.mean(np.square(errors / stds))) == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize("held", [(0.02, 0.005), (0.035, 0.005), (0.05, 0.01), (0.07, 0.015)])
def test_where_no_position_is_heard_creep_of_all_axles_is_thought_possible(held: Held) -> None:
    """Taken for wheels that roll, 36 to 77 % of these speeds lay beyond 3 standard deviations; now 0 to 5 % do."""
    _, errors, stds = np.hstack([deviations(seed, held, 30.0, dark=True) for seed in range(12)])
    assert np.mean(np.abs(errors) > 3.0 * stds) < 0.1


def test_rims_that_agree_behind_a_slide_roll_again() -> None:
    """They were not believed for 2 min, so that in a tunnel the speed was known ever worse."""
    for seed in range(3):
        speeds, errors, stds = deviations(seed, (0.3, 0.02), 12.0, rolls=20.0, dark=True)
        assert stds[-1] < 0.02 * speeds[-1]
        assert abs(errors[-1]) < 0.02 * speeds[-1]


def test_a_rim_that_slides_for_a_while_tells_nothing_of_those_that_roll() -> None:
    slid = np.where((np.arange(40) > 25) & (np.arange(40) < 32), -0.3, 0.0)
    assert shown(slid) == Errors(ROLLS, 0.0)

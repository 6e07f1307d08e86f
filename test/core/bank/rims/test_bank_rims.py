# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a rim's speed does to the belief, against sums over a grid, and a train whose wheels are worn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from banks import S, bank_of
from scipy.stats import norm

from adhesion_node.core.bank.findings.learnt import learnt
from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.free import either
from adhesion_node.core.bank.gear.axles import ROLLS
from adhesion_node.core.bank.layout import RADIUS, SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.bank.rims.rim import (
    CREEP,
    FASTEST_SHARE,
    SLIDES,
    as_fast,
    as_rolled,
    not_slower,
    rim_speed,
    rolled_of,
    rolling,
)
from adhesion_node.core.bank.seeing import corrected, speed_seen
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import Measurement, WheelSample
from adhesion_node.core.physics.train import Array

CONFIG = Config(method="bank")
BANK = bank_of([1, 2, 3, 1])
ALONE = bank_of([1, 2], spread=0.0)
RAIL = Rail(0.05, 0.04, 0.02)
WORN = np.array([0.975, 0.96, 0.98, 0.965])
"""True over expected radii."""


def test_a_slower_rim_says_nothing() -> None:
    after = not_slower(BANK, 30.0, 0.24)
    assert after.mean == pytest.approx(BANK.mean, abs=1e-6)
    assert after.covariance == pytest.approx(BANK.covariance, rel=1e-6, abs=1e-9)
    assert np.array_equal(after.log_weight, BANK.log_weight)


def test_radii_that_measured_speeds_have_told_go_with_the_scale_of_these_behind_a_slide_too() -> None:
    """Each braking made the speed known better than its scale, by rims that the same speeds had measured."""
    bank = either(met(CONFIG, Measurement(S, 0.0, math.inf, 0.0)).bank)
    bank = bank.with_fresh(SPEED, np.full(bank.kind.size, 26.0), 1.0)
    for _ in range(50):
        bank = corrected(bank, speed_seen(bank, 26.0, 0.01)).normalised()
        bank = rolling(bank, 26.3).normalised()
    before, rolled = bank.std_of(SPEED), rolled_of(bank)
    for _ in range(3):  # all rims creep, and roll again
        bank.covariance[:, RADIUS, RADIUS] += 0.02**2
        bank = rolling(as_rolled(bank, rolled), 26.3).normalised()
        rolled = rolled_of(bank)
    assert bank.std_of(SPEED) == pytest.approx(before, rel=0.01)
    assert bank.mean_of(RADIUS) == pytest.approx(0.9 * 0.3 / 26.0, rel=0.02)  # radii: 0.03, scale: 0.01
    assert as_rolled(bank, None) is bank
    assert rolled_of(rolling(met(replace(CONFIG, speed_scale_std=0.0), Measurement(S, 0.0, math.inf)).bank, 26.3))


def test_a_faster_rim_corrects_and_weighs() -> None:
    after, before = not_slower(BANK, 41.5, 0.3), BANK
    assert np.all(after.mean[:, SPEED] > before.mean[:, SPEED])
    assert np.all(after.covariance[:, SPEED, SPEED] < before.covariance[:, SPEED, SPEED])
    assert np.all(after.log_weight < before.log_weight)
    rims = before.mean[:, SPEED] * (1.0 + before.mean[:, RADIUS])
    lost = before.log_weight - after.log_weight
    assert lost[np.argmin(rims)] >= lost[np.argmax(rims)]
    assert np.all(not_slower(BANK, 1000.0, 8.0).mean[:, SPEED] < 60.0)  # clipped


@pytest.mark.parametrize(("off", "loses"), [(-1.0, 0.0), (1.0, 0.5), (2.0, 2.0)])
def test_what_is_slower_than_a_rim_loses_by_the_square_of_its_deviation(off: float, loses: float) -> None:
    for index, (speed, radius) in enumerate(BANK.mean[:, (SPEED, RADIUS)]):
        rim = speed * (1.0 + radius) / (1.0 - off * FASTEST_SHARE)
        lost = BANK.log_weight - not_slower(BANK, rim, FASTEST_SHARE * rim).log_weight
        assert lost[index] == pytest.approx(loses)


@pytest.mark.parametrize("off", [-4.0, -1.0, -0.4, -0.1, 0.0, 0.2])
def test_the_fastest_rim_is_the_trains_speed_or_slides(off: float) -> None:
    """Mean, variance and evidence of a speed known to 0.4 m/s, against sums over a grid of it."""
    bank = ALONE.with_fresh(RADIUS, 0.0, 0.0).with_fresh(SPEED, 40.0, 0.4)
    rim = (40.0 + off) / (1.0 + CREEP)
    after = as_fast(bank, rim, ROLLS * rim)
    speed, error = np.linspace(34.0, 46.0, 24001), ROLLS * rim
    likely = norm.pdf(40.0 + off, speed, error) + SLIDES / error
    density = norm.pdf(speed, 40.0, 0.4) * likely
    total = density.sum()
    mean = float((density * speed).sum() / total)
    assert after.mean[:, SPEED] == pytest.approx(mean, abs=1e-4)
    variance = float((density * (speed - mean) ** 2).sum() / total)
    assert after.covariance[:, SPEED, SPEED] == pytest.approx(variance, rel=1e-3)
    assert after.log_weight - bank.log_weight == pytest.approx(math.log(total * (speed[1] - speed[0])), abs=1e-4)


@pytest.mark.parametrize("rim", [33.0, 1000.0])
def test_a_rim_that_no_hypothesis_foresees_moves_nothing(rim: float) -> None:
    after = as_fast(BANK, rim, ROLLS * rim)
    assert after.mean == pytest.approx(BANK.mean, abs=1e-2)
    assert after.covariance == pytest.approx(BANK.covariance, rel=0.05, abs=1e-2)
    assert np.ptp(after.log_weight - BANK.log_weight) < 1e-2


def test_unbraked_a_rim_tells_of_radius_and_speed_alike() -> None:
    """A rim that is 1 m/s faster than foreseen: the sum of what it moves both by is that 1 m/s, near enough."""
    bank = ALONE.with_fresh(RADIUS, 0.0, 0.03).with_fresh(SPEED, 40.0, 3.0)
    after = rolling(bank, 41.0)
    speed, std = rim_speed(after.normalised())
    assert speed == pytest.approx(41.0, abs=0.1)
    assert std < rim_speed(bank)[1]
    assert np.all(after.mean[:, SPEED] > 40.5)
    assert np.all(after.mean[:, RADIUS] > 0.0)


def travelled(
    seconds: float, creep: Array | float = 0.0, slowing: float = 0.0, from_s: float | None = None, driven: float = 0.0
) -> tuple[Memory, float]:
    """At 30 m/s unbraked, the second half under the full brake, or from `from_s` on; positions err slowly by 2 m.

    Of `driven` wheels the rims are faster by so much, by turns for 40 s.
    """
    from_s = seconds / 2.0 if from_s is None else from_s
    rng, memory, offset, place, speed = np.random.default_rng(3), None, 0.0, 0.0, 30.0
    for index in range(round(10.0 * seconds)):
        t_ns, braked = S + index * S // 10, 0.1 * index >= from_s
        offset += -offset / 300.0 + 2.0 * math.sqrt(2.0 / 300.0) * rng.standard_normal()
        slower = speed - 0.1 * slowing * braked
        place, speed = place + 0.05 * (speed + slower), slower
        drive = driven * (index // 400 % 2)
        rates = speed * (1.0 - creep * braked + drive) / (0.46 * WORN) * (1.0 + 0.003 * rng.standard_normal(4))
        wheels = (WheelSample(t_ns, tuple(rates.tolist())),)
        seen = place + offset + 0.1 * rng.standard_normal()
        measured = Measurement(t_ns, seen, 4.0, 410e3 * braked, wheels=wheels)
        memory = met(CONFIG, measured) if memory is None else followed(CONFIG, memory, measured, lambda: RAIL)
    assert memory is not None
    return memory, speed


def test_worn_wheels_tell_the_speed_of_a_train_whose_positions_wander() -> None:
    """60 s at 30 m/s, the first half unbraked: the radii come to be known to a percent, and so does the speed."""
    memory, speed = travelled(60.0)
    rim = learnt(memory)["rim_speed_error"]
    assert 1.0 / (1.0 + rim) == pytest.approx(np.median(WORN), rel=0.01)
    told = [learnt(memory)[f"wheel_radius.{axle}"] for axle in range(4)]
    assert told == pytest.approx(WORN, rel=0.01)
    assert learnt(memory)["rim_speed_error_std"] < 0.01
    assert memory.bank.mean_of(SPEED) == pytest.approx(speed, rel=0.01)


@pytest.mark.parametrize("creep", [np.array([0.001, 0.1, 0.2, 0.15]), np.full(4, 0.08), np.full(4, 0.12)])
def test_axles_that_slide_do_not_slow_the_train(creep: Array) -> None:
    """30 s, the second half under the brake at 0.6 m/s^2: one axle rolls, or all slide as one to the end."""
    memory, speed = travelled(30.0, creep, 0.6)
    assert memory.bank.mean_of(SPEED) == pytest.approx(speed, rel=0.02)


def test_after_a_long_way_the_speed_is_not_surer_than_wheels_that_drive() -> None:
    """10 minutes in which traction makes every rim 0.3 % faster by turns."""
    memory, speed = travelled(600.0, from_s=math.inf, driven=0.003)
    mean, covariance = memory.bank.moments()
    assert 0.001 * speed < math.sqrt(covariance[SPEED, SPEED]) < 0.01 * speed
    assert abs(mean[SPEED] - speed) < 3.0 * math.sqrt(covariance[SPEED, SPEED])
    assert learnt(memory)["rim_speed_error_std"] > 0.001

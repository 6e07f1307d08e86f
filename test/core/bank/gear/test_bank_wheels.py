# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the wheels tell of a simulated train, whose radii, sliding axles and faults are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from banks import S

from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.gear.slides import FRESH_NS, SLID_NS, told
from adhesion_node.core.bank.gear.wheels import WheelsSeen
from adhesion_node.core.bank.layout import SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import Measurement, SpeedSample, WheelSample
from adhesion_node.core.physics.train import Array

CONFIG = Config(method="bank")
RADIUS_M = 0.46
WORN = np.array([1.0, 0.97, 0.985, 1.01])
EVEN = np.ones(4)
MS = S // 1000

RAIL = Rail(0.05, 0.04, 0.02)


def sample(t_ns: int, speed: float, creep: Array, radius: Array, rng: np.random.Generator | None = None) -> WheelSample:
    noise = 0.0 if rng is None else 0.002 * rng.standard_normal(creep.size)
    rates = speed * (1.0 - creep) / (RADIUS_M * radius) * (1.0 + noise)
    return WheelSample(t_ns, tuple(rates.tolist()))


def coasted(radius: Array, std: float = 0.1, seconds: float = 30.0, speed: float = 40.0) -> WheelsSeen:
    rng, wheels = np.random.default_rng(1), WheelsSeen()
    for index in range(round(seconds * 10)):
        rolling = sample(S + index * 100 * MS, speed, np.zeros(radius.size), radius, rng)
        wheels = wheels.after(CONFIG, rolling, speed, std, False)
    return wheels


def braked(wheels: WheelsSeen, creep: Array, radius: Array, speed: float = 40.0, std: float = 0.1) -> WheelsSeen:
    for index in range(10):
        wheels = wheels.after(CONFIG, sample(100 * S + index * 100 * MS, speed, creep, radius), speed, std, True)
    return wheels


NOW = 100 * S + 900 * MS


def test_radii_are_learnt_while_coasting() -> None:
    wheels = coasted(WORN)
    assert wheels.radii.own == pytest.approx(WORN / np.median(WORN), rel=1e-3)
    assert (wheels.radii.learnt, wheels.radii.is_learnt) == (300, True)
    assert 1e-3 < math.sqrt(wheels.radii.noise) < 3e-3
    rims = wheels.radii.rims(CONFIG, sample(40 * S, 35.0, np.zeros(4), WORN))
    assert rims == pytest.approx([35.0 / np.median(WORN)] * 4, rel=2e-3)
    assert wheels.radii.fastest(rims) == pytest.approx(35.0 / np.median(WORN), rel=4e-3)


@pytest.mark.parametrize(("rate_hz", "speed", "seconds"), [(10.0, 40.0, 0.7), (1.0, 40.0, 6.5), (10.0, 6.0, 2.2)])
def test_radii_are_soon_learnt(rate_hz: float, speed: float, seconds: float) -> None:
    """By six samples, however seldom they come, and by a way of 12 m; not before."""
    wheels, learnt_s = WheelsSeen(), math.inf
    for index in range(100):
        wheels = wheels.after(
            CONFIG, sample(S + round(index * S / rate_hz), speed, np.zeros(4), WORN), speed, 0.1, False
        )
        learnt_s = min(learnt_s, index / rate_hz) if wheels.radii.is_learnt else learnt_s
    assert max(5.0 / rate_hz, 12.0 / speed) <= learnt_s < seconds


def test_nothing_is_learnt_slowly() -> None:
    wheels = coasted(WORN, speed=4.0)
    assert wheels.radii.own == (1.0,) * 4
    assert not wheels.radii.is_learnt


def test_of_many_that_roll_the_fastest_is_fast_by_chance() -> None:
    rng, wheels = np.random.default_rng(7), coasted(np.ones(16))
    told = [wheels.radii.rims(CONFIG, sample(S, 40.0, np.zeros(16), np.ones(16), rng)) for _ in range(200)]
    assert np.mean([max(rims) for rims in told]) > 1.003 * 40.0
    assert np.mean([wheels.radii.fastest(rims) for rims in told]) == pytest.approx(40.0, rel=2e-3)


@pytest.mark.parametrize("radius", [EVEN, WORN])
@pytest.mark.parametrize("sliding", [0, 1, 2, 3, 4])
def test_sliding_axles_are_counted_each_by_its_own_radius(radius: Array, sliding: int) -> None:
    creep = np.where(np.arange(4) < sliding, 0.12, 0.003)
    wheels = braked(coasted(radius), creep, radius)
    assert wheels.slides.share(NOW) == pytest.approx(sliding / 4)


@pytest.mark.parametrize("sliding", [0, 1, 3])
def test_worn_wheels_of_which_nothing_was_learnt_slide_by_the_others_at_most(sliding: int) -> None:
    """Wear of 3 % beside the creep of a slide, 15 %: neither is taken for the other."""
    creep = np.where(np.arange(4) < sliding, 0.15, 0.003)
    wheels = braked(WheelsSeen(), creep, np.array([0.985, 0.99, 1.0, 0.995]))
    share = wheels.slides.share(NOW)
    assert share == pytest.approx(sliding / 4)


def test_all_axles_that_slide_alike_are_told_by_the_trains_speed() -> None:
    assert braked(coasted(EVEN), np.full(4, 0.1), EVEN).slides.share(NOW) == 1.0


@pytest.mark.parametrize("creep", [0.05, 0.1, 0.3])
def test_a_train_held_slower_than_it_is_claims_no_rolling(creep: float) -> None:
    """Positions of a wheel that slides give a speed as low as that: the axles agree with it, and one rolls faster."""
    wheels = coasted(EVEN)
    slips = np.array([creep, creep, creep, 0.002])
    for index in range(10):
        stamp = 100 * S + index * 100 * MS
        wheels = wheels.after(CONFIG, sample(stamp, 40.0, slips, EVEN), 40.0 * (1.0 - creep), 0.1, True)
    assert wheels.slides.share(NOW) == 0.75
    assert wheels.radii.fastest(wheels.radii.rims(CONFIG, sample(NOW, 40.0, slips, EVEN))) == pytest.approx(
        39.92, rel=3e-3
    )


def test_an_unsure_speed_claims_neither() -> None:
    wheels = braked(coasted(EVEN), np.full(4, 0.05), EVEN, std=4.0)
    assert wheels.slides.share(NOW) is None


def test_a_dropout_leaves_the_others() -> None:
    creep = np.array([0.12, math.nan, 0.003, math.nan])
    wheels = braked(coasted(WORN), creep, WORN)
    assert wheels.slides.share(NOW) == 0.5
    assert all(math.isfinite(each) for each in wheels.radii.own)
    three = braked(coasted(WORN), np.array([0.12, math.nan, math.nan, math.nan]), WORN)
    assert three.slides.share(NOW) is None  # of too few it is known
    nothing = sample(NOW, 40.0, np.full(4, math.nan), WORN)
    assert wheels.after(CONFIG, nothing, 40.0, 0.1, True).slides.share(NOW) == 0.5


def test_dropouts_while_learning_spoil_nothing() -> None:
    rng, wheels = np.random.default_rng(2), WheelsSeen()
    for index in range(300):
        rates = list(sample(S + index * 100 * MS, 40.0, np.zeros(4), WORN, rng).speeds_radps)
        rates[index % 4] = math.nan if index % 2 else 0.0
        wheels = wheels.after(CONFIG, WheelSample(S + index * 100 * MS, tuple(rates)), 40.0, 0.1, False)
    assert wheels.radii.own == pytest.approx(WORN / np.median(WORN), rel=3e-3)


def test_another_number_of_axles_is_another_train() -> None:
    wheels = coasted(WORN)
    two = sample(50 * S, 40.0, np.zeros(2), EVEN[:2])
    assert wheels.radii.rims(CONFIG, two) == []
    after = wheels.after(CONFIG, two, 40.0, 0.1, True)
    assert len(after.radii.own) == len(after.slides.slid_ns) == len(after.slides.rolled_ns) == 2
    assert after.radii.own == (1.0, 1.0)
    assert after.radii.learnt == 0


def test_what_was_seen_fades() -> None:
    wheels = braked(coasted(EVEN), np.array([0.12, 0.003, 0.003, 0.003]), EVEN)
    assert wheels.slides.share(NOW + FRESH_NS - 1) == 0.25
    assert wheels.slides.share(NOW + FRESH_NS) is None  # of those that rolled nothing is heard
    assert wheels.slides.share(NOW + SLID_NS) is None


def test_an_axle_counts_as_sliding_between_its_slides() -> None:
    wheels = coasted(EVEN)
    for index in range(100):
        creep = np.where(index % 20 < 8, np.array([0.2, 0.0, 0.0, 0.0]), 0.003)
        stamp = 100 * S + index * 100 * MS
        wheels = wheels.after(CONFIG, sample(stamp, 40.0, creep, EVEN), 40.0, 0.1, True)
        assert wheels.slides.share(stamp) == 0.25


def test_an_axle_whose_slides_fall_between_samples_counts_as_sliding() -> None:
    """Heard once a second it is seen to slide every fifth time."""
    wheels = coasted(EVEN)
    for index in range(40):
        creep = np.where(index % 5 == 0, np.array([0.2, 0.0, 0.0, 0.0]), 0.003)
        wheels = wheels.after(CONFIG, sample((100 + index) * S, 40.0, creep, EVEN), 40.0, 0.1, True)
        assert wheels.slides.share((100 + index) * S) == 0.25


def test_axles_that_protection_lets_roll_in_turns_use_no_more_than_the_rail_gives() -> None:
    """Each of four slides for 1 s in 10, and is then pressed again slowly: the rail gives 0.03 all the time.

    Before: those that had slid longer than 3 s ago counted as using what the whole brake asks for.
    """
    memory: Memory | None = None
    shares = []
    for index in range(600):
        t_ns, braked_s = S + index * 100 * MS, max(0.1 * (index - 200), 0.0)
        speed = 40.0 - 9.8 * 0.035 * braked_s
        slides = (braked_s > 0.0) & ((braked_s - 2.5 * np.arange(4)) % 10.0 < 1.0)
        wheels = (sample(t_ns, speed, np.where(slides, 0.15, 0.003), EVEN),)
        where = 4.0 * index - 0.5 * 9.8 * 0.035 * braked_s**2
        measured = Measurement(t_ns, where, 0.04, 410e3 * (braked_s > 0.0), wheels=wheels)
        memory = met(CONFIG, measured) if memory is None else followed(CONFIG, memory, measured, lambda: RAIL)
        shares.append(memory.braking.share)
    assert min(shares[300:]) == 1.0


def test_standing_wheels_are_no_judges() -> None:
    wheels = coasted(EVEN)
    assert wheels.after(CONFIG, WheelSample(50 * S, (0.0,) * 4), 0.0, 0.1, True) == wheels


def test_what_counts_as_told() -> None:
    assert [told(share, False) > 0 for share in (0.0, 0.1, 0.25, 1.0)] == [False, False, True, True]
    assert told(0.0, True) < 0.0 < told(None, True)
    assert told(None, False) == told(0.1, True) == 0.0


@pytest.mark.parametrize("idle_pa", [-3e3, 0.0, 3e3])
def test_radii_are_learnt_whatever_a_released_cylinder_seems_to_hold(idle_pa: float) -> None:
    """A gauge that is off by less than the brake's threshold tells of no brake."""
    memory: Memory | None = None
    for index in range(100):
        t_ns = S + index * 100 * MS
        wheels = (sample(t_ns, 40.0, np.zeros(4), WORN),)
        speeds = (SpeedSample(t_ns, 40.0, 0.01),)
        measured = Measurement(t_ns, 4.0 * index, 0.04, idle_pa, 40.0, speeds=speeds, wheels=wheels)
        memory = met(CONFIG, measured) if memory is None else followed(CONFIG, memory, measured, lambda: RAIL)
    assert memory is not None
    assert memory.wheels.radii.learnt > 50
    assert memory.wheels.radii.own == pytest.approx(WORN / np.median(WORN), rel=3e-3)
    assert memory.wheels.slides.share(memory.t_ns) is None


def test_the_fastest_rim_bounds_the_speed_while_positions_are_out() -> None:
    """20 s at 40 m/s, then 12 s of the full brake on a rail that gives 0.03, which nothing but an axle tells."""
    memory: Memory | None = None
    creep = np.array([0.0, 0.3, 0.2, 0.5])
    for index in range(320):
        t_ns, braked_s = S + index * 100 * MS, max(0.1 * (index - 200), 0.0)
        speed = 40.0 - 9.8 * 0.037 * braked_s
        wheels = (sample(t_ns, speed, creep * (braked_s > 0.0), EVEN),)
        where = (4.0 * index, 0.04) if braked_s == 0.0 else (0.0, math.inf)
        measured = Measurement(t_ns, *where, 410e3 * (braked_s > 0.0), wheels=wheels)
        memory = met(CONFIG, measured) if memory is None else followed(CONFIG, memory, measured, lambda: RAIL)
    assert memory is not None
    assert memory.bank.mean_of(SPEED) >= 0.997 * speed


def test_axles_that_begin_to_slide_unseen_and_all_alike_are_thought_of() -> None:
    """20 s at 40 m/s, then the full brake on a rail that gives 0.03, all rims slower by too little to be told."""
    memory: Memory | None = None
    for index in range(212):
        t_ns, braked_s = S + index * 100 * MS, max(0.1 * (index - 200), 0.0)
        speed = 40.0 - 9.8 * 0.035 * braked_s
        wheels = (sample(t_ns, speed, np.full(4, 0.02 * (braked_s > 0.0)), EVEN),)
        where = 4.0 * index - 0.5 * 9.8 * 0.035 * braked_s**2
        measured = Measurement(t_ns, where, 0.04, 410e3 * (braked_s > 0.0), wheels=wheels)
        memory = met(CONFIG, measured) if memory is None else followed(CONFIG, memory, measured, lambda: RAIL)
    assert memory is not None
    assert memory.wheels.slides.share(memory.t_ns) == 0.0
    speeds = memory.bank.mean[:, SPEED]
    assert speeds.min() < speed - 0.2, "the brake holds"
    assert speeds.max() > speed - 0.1, "or none of them rolls"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How hypotheses come and go: probabilities, numbers and moments; changes of the rail, found once and not made up."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from banks import CONFIG, FULL, FULL_PA, S, bank_of
from oracles import specific_resistance
from scipy.stats import norm

from adhesion_node.core import Config, Measurement, finish, init, step
from adhesion_node.core.bank.branching import LEAST, MOST, branched, opened, pruned
from adhesion_node.core.bank.free import closed
from adhesion_node.core.bank.gear.brake import BrakeSeen
from adhesion_node.core.bank.judging import judged
from adhesion_node.core.bank.labels.kinds import FREE, HELD, KINDS, OTHER, SLIDES, SLIDING, STEADY
from adhesion_node.core.bank.layout import MU, ROUGH, SIZE, Bank, joined
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.bank.motion import Braking
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.physics.train import Array


def moments(bank: Bank) -> tuple[Array, Array]:
    """Mean and covariance of a mixture, E[x x'] - E[x] E[x]', hypothesis by hypothesis."""
    weights = np.exp(bank.log_weight) / np.exp(bank.log_weight).sum()
    rows = list(zip(weights, bank.mean, bank.covariance, strict=True))
    mean = sum((w * x for w, x, _ in rows), np.zeros(bank.mean.shape[1]))
    second = sum((w * (p + np.outer(x, x)) for w, x, p in rows), np.zeros(bank.covariance.shape[1:]))
    return mean, second - np.outer(mean, mean)


def is_normalised(bank: Bank) -> bool:
    return math.isclose(float(np.exp(bank.log_weight).sum()), 1.0, rel_tol=1e-12)


def test_moments_are_those_of_the_mixture() -> None:
    bank = bank_of([1, 2, 3, 4, 5], seed=2)
    mean, covariance = moments(bank)
    got = bank.moments()
    assert got[0] == pytest.approx(mean, rel=1e-12)
    assert got[1] == pytest.approx(covariance, rel=1e-6, abs=1e-9)
    # whatever the weights sum to
    assert bank._replace(log_weight=bank.log_weight + 3.0).moments()[0] == pytest.approx(mean, rel=1e-12)


@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize("rail", [Rail(0.08, 0.005, 0.072), Rail(0.05, 0.04, 0.02), Rail(0.03, 0.02, 0.015)])
def test_a_braking_opens_with_the_rail_as_it_is_known(rail: Rail, alone: bool) -> None:
    start = bank_of([0, 0, 0], noises=[0, 1, 2])
    bank = opened(CONFIG, start, rail, alone)
    assert is_normalised(bank)
    sliding = bank.part(SLIDES[bank.kind])
    std = np.sqrt(sliding.covariance[:, MU, MU])
    below = [float(sliding.weight @ norm.cdf((mu - sliding.mean[:, MU]) / std)) for mu in (rail.lower, rail.mu, 0.0)]
    # parts that are Gaussian in proportion are not quite log-normal together
    assert np.array(below) / sliding.weight.sum() == pytest.approx([0.05, 0.5, 0.0], abs=0.03)
    priors = {kind: float(bank.weight @ (bank.kind == kind)) for kind in (HELD, *SLIDING, *[OTHER] * alone)}
    total = sum(KINDS[kind].prior for kind in priors)
    assert priors == pytest.approx({kind: KINDS[kind].prior / total for kind in priors})
    grows = np.array([kind.growth != 0.0 for kind in KINDS])[sliding.kind]
    steady = sliding.part(~grows)
    on_slippery, on_wet = np.array([0.81, 0.19 * 0.1, 0.19 * 0.9]), np.array([0.9, 0.1 * 0.55, 0.1 * 0.45])
    for mu in set(steady.mean[:, MU].tolist()):  # the wetter, the less likely a film that gives the same at any speed
        of_level, wet = steady.part(steady.mean[:, MU] == mu), min(max((mu - 0.04) / 0.03, 0.0), 1.0)
        laws = [float(of_level.weight @ (of_level.law == law)) / float(of_level.weight.sum()) for law in range(3)]
        assert laws == pytest.approx((1.0 - wet) * on_slippery + wet * on_wet)
    assert set(sliding.law[grows]) == {2}
    for noise in range(3):
        assert float(bank.weight @ (bank.noise == noise)) == pytest.approx(start.weight[noise])
    assert np.all(bank.born_s == -math.inf)


def test_a_braking_closes_to_two_hypotheses_for_each_noise() -> None:
    bank = opened(CONFIG, bank_of([0, 0], noises=[1, 3]), Rail(0.05, 0.04, 0.02), alone=True)
    free = closed(bank)
    assert free.noise.tolist() == [1, 3, 1, 3]
    assert free.kind.tolist() == [FREE, FREE, STEADY, STEADY]
    assert free.weight[:2] == pytest.approx(free.weight[2:])
    assert is_normalised(free)
    kept = [index for index in range(bank.mean.shape[1]) if index not in {MU, ROUGH}]
    for row, noise in enumerate(free.noise):
        mean, covariance = moments(bank.part(bank.noise == noise))
        assert free.mean[row, kept] == pytest.approx(mean[kept])
        assert free.covariance[row][np.ix_(kept, kept)] == pytest.approx(covariance[np.ix_(kept, kept)], abs=1e-9)


@pytest.mark.parametrize("told", [0.0, 4.0, -4.0])
@pytest.mark.parametrize("rising", [False, True])
def test_branching_keeps_what_is_and_adds_the_unlikely(told: float, rising: bool) -> None:
    bank = bank_of([1, 2, 3, 5], laws=[0, 0, 1, 2], seed=4, spread=0.0)
    after = branched(CONFIG, bank, Braking(FULL, 1.0, rising, told), 12.0, 0.5)
    assert is_normalised(after)
    count = bank.log_weight.size
    assert after.log_weight.size > count
    assert np.array_equal(after.mean[:count], bank.mean)
    assert np.array_equal(after.covariance[:count], bank.covariance)
    # weights keep their ratios
    shifted = after.log_weight[:count] - bank.log_weight
    assert shifted == pytest.approx(np.full(count, shifted[0]), abs=1e-12)
    new = after.part(np.arange(count, after.log_weight.size))
    assert np.all(new.born_s == 12.0)
    assert float(new.weight.sum()) < 0.5
    if told > 0.0:  # axles that are known to slide do not roll
        assert not np.any(new.kind == HELD)


def test_axles_that_are_known_to_roll_do_not_begin_to_slide() -> None:
    held = bank_of([HELD], spread=0.0)
    for told, expected in ((-4.0, False), (0.0, True), (4.0, True)):
        assert bool(SLIDES[branched(CONFIG, held, Braking(FULL, told=told), 12.0, 0.5).kind].any()) == expected


@pytest.mark.parametrize("build_up_s", [2.5, 5.0, 20.0])
def test_a_slow_brake_makes_axles_slide_no_likelier(build_up_s: float) -> None:
    """It passes the same adhesion on its way up: two fifths of what rolled have begun to slide behind it, not all."""
    config, braking = replace(CONFIG, brake_build_up_s=build_up_s), Braking(FULL, rising=True)
    held, rolls = bank_of([HELD], spread=0.0), 1.0
    for _ in range(round(build_up_s / 0.5)):
        after = branched(config, held, braking, 12.0, 0.5)
        rolls *= float(after.weight @ (after.kind == HELD))
    assert rolls == pytest.approx(0.6, abs=0.05)


def test_the_longer_asked_the_likelier_a_change() -> None:
    bank = bank_of([2], seed=4, spread=0.0)
    weights = [
        float(after.weight @ (after.changed_s > 0.0))
        for after in (branched(CONFIG, bank, Braking(FULL), 12.0, elapsed) for elapsed in (0.1, 0.5, 2.0))
    ]
    assert weights == sorted(weights)
    assert weights[1] == pytest.approx(0.5 / 300.0, rel=0.1)


@pytest.mark.parametrize("seed", range(5))
def test_pruning_bounds_the_number_and_loses_little(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = 150
    kinds = rng.integers(1, len(KINDS), count).tolist()
    bank = bank_of(kinds, rng.integers(0, 3, count).tolist(), rng.integers(0, 4, count).tolist(), seed, spread=3.0)
    bank = bank._replace(log_weight=rng.uniform(-15.0, 0.0, count)).normalised()
    after = pruned(bank)
    assert after.log_weight.size <= MOST
    assert is_normalised(after)
    best = int(np.argmax(bank.log_weight))
    assert after.weight.max() >= bank.weight[best]
    again = pruned(after)
    assert again.log_weight.size <= after.log_weight.size
    assert np.all(after.weight > 0.9 * LEAST)


def test_uniting_keeps_the_moments_of_the_mixture() -> None:
    rng = np.random.default_rng(9)
    one = bank_of([2], seed=9)
    near = [
        one._replace(
            mean=one.mean + 0.05 * np.sqrt(np.diagonal(one.covariance, axis1=1, axis2=2)) * rng.standard_normal(SIZE),
            covariance=one.covariance * scale,
            log_weight=np.array([math.log(weight)]),
        )
        for scale, weight in ((1.0, 0.5), (1.1, 0.3), (0.9, 0.2))
    ]
    bank = joined(near)
    after = pruned(bank)
    assert after.log_weight.size == 1
    mean, covariance = moments(bank)
    assert after.mean[0] == pytest.approx(mean, rel=1e-9)
    assert after.covariance[0] == pytest.approx(covariance, rel=1e-6, abs=1e-9)


def test_what_differs_is_not_united() -> None:
    one = bank_of([2], seed=9)
    elsewhere = one._replace(mean=one.mean + np.where(np.arange(SIZE) == MU, 0.05, 0.0))
    for other in (
        one._replace(kind=np.array([3])),
        one._replace(law=np.array([1])),
        one._replace(noise=np.array([1])),
        elsewhere,
        one._replace(covariance=4.0 * one.covariance),
    ):
        bank = joined((one, other)).normalised()
        after = pruned(bank)
        assert after.log_weight.size == 2
        for got, expected in zip(moments(after), moments(bank), strict=True):
            assert got == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_nothing_is_lost_for_good_while_coasting() -> None:
    bank = bank_of([0, 0], noises=[0, 1])._replace(log_weight=np.array([0.0, -500.0]))
    kept = bank.normalised(math.log(1e-5))
    assert is_normalised(kept)
    assert kept.weight[1] == pytest.approx(1e-5, rel=1e-4)


def ride(seed: int, brakings: list[tuple[float, float, float]], seconds: float) -> list[Measurement]:
    """Positions, 0.2 m, at 5 Hz of a train that brakes from, to, at mu, and else accelerates to 70 m/s."""
    rng, h, result = np.random.default_rng(seed), 0.02, []
    s, v, speed_noise = 0.0, 60.0, 0.01
    for index in range(round(seconds / h)):
        time = index * h
        mu = next((mu for start, end, mu in brakings if start <= time < end), None)
        if index % 10 == 0:
            pressure = 0.0 if mu is None else FULL_PA
            t_ns = S + round(time * 1e9)
            result.append(Measurement(t_ns, s + 0.2 * float(rng.standard_normal()), 0.04, pressure))
        resistance = float(specific_resistance(np.array(v)))
        slowing = 9.8 * (min(mu, FULL) + resistance) if mu is not None else -0.5 if v < 70.0 else 0.0
        s, v = s + h * v, v - h * slowing + speed_noise * math.sqrt(h) * float(rng.standard_normal())
    return result


def changes_of(measurements: list[Measurement], config: Config = CONFIG) -> list[tuple[float, int]]:
    """Times and numbers of changes, of every estimate."""
    state, told = init(config, 1), list[tuple[float, int]]()
    for each in measurements:
        state, estimate = step(config, state, each)
        told += [] if estimate is None else [((estimate.t_ns - S) / S, estimate.changes)]
    return told + [((each.t_ns - S) / S, each.changes) for each in finish(config, state)[1]]


@pytest.mark.parametrize(("before", "after"), [(0.03, 0.07), (0.07, 0.03)])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_changed_rail_is_found_and_told_once(before: float, after: float, seed: int) -> None:
    told = changes_of(ride(seed, [(10.0, 30.0, before), (30.0, 50.0, after)], 50.0))
    assert told[-1][1] == 1
    assert all(count == 0 for time, count in told if time < 30.0)
    assert all(count == 1 for time, count in told if time > 36.0)


@pytest.mark.parametrize(("length_m", "counted"), [(1.0, 2), (900.0, 1)])
def test_while_a_border_lies_under_the_train_it_tells_no_other(length_m: float, counted: int) -> None:
    """Two falls within 7 s: one after the other under a short train, both under one that takes 15 s to pass."""
    config = replace(CONFIG, train=replace(CONFIG.train, length_m=length_m))
    told = changes_of(ride(0, [(10.0, 24.0, 0.08), (24.0, 31.0, 0.05), (31.0, 42.0, 0.025)], 42.0), config)
    assert told[-1][1] == counted


@pytest.mark.parametrize(("seed", "mu"), [(0, 0.03), (2, 0.07)])
def test_an_unchanged_rail_is_not_told_in_ten_minutes(seed: int, mu: float) -> None:
    """25 s of braking out of every 60 s: with the seeds named 0 changes are told."""
    told = changes_of(ride(seed, [(60.0 * n + 30.0, 60.0 * n + 55.0, mu) for n in range(10)], 600.0))
    assert told[-1][1] == 0


@pytest.mark.parametrize(("mu", "changes"), [(0.05, 0), (0.035, 1)])
def test_a_swing_is_no_change_of_the_rail(mu: float, changes: int) -> None:
    """What is used is 0.04 before the doubt, and 0.06 or 0.042 behind it: by a swing from - 20 to + 20 %, or more."""
    kind = [each.name for each in KINDS].index("swinging")
    sure = bank_of([kind], spread=0.0)
    sure = sure._replace(covariance=1e-6 * sure.covariance, changed_s=np.array([50.0]))
    before = sure.with_fresh(MU, 0.05, 1e-4).with_fresh(ROUGH, -0.2, 0.01)
    behind = sure.with_fresh(MU, mu, 1e-4).with_fresh(ROUGH, 0.2, 0.01)
    brake, braking = BrakeSeen(demanded_pa=FULL_PA), Braking(FULL)
    memory = Memory(
        behind, 60 * S, 1.0, brake, braking=braking, seen=100, told_s=30.0, steady=(before, braking), slid=True
    )
    assert judged(CONFIG, memory, lambda: Rail(0.05, 0.04, 0.02)).changes == changes


@pytest.mark.parametrize(("mu", "std", "changes", "waits"), [(0.03, 0.002, 1, False), (0.03, 0.012, 0, True)])
def test_a_change_is_told_once_it_is_beyond_what_is_not_known(mu: float, std: float, changes: int, waits: bool) -> None:
    """From 0.05, certain: to 0.03 +- 0.002, and to 0.03 +- 0.012, which a receiver's wandering shows as well."""
    kind = [each.name for each in KINDS].index("smooth")
    sure = bank_of([kind], spread=0.0).with_fresh(ROUGH, 0.0, 0.0)
    sure = sure._replace(covariance=1e-6 * sure.covariance, changed_s=np.array([50.0]))
    before, behind = sure.with_fresh(MU, 0.05, 1e-4), sure.with_fresh(MU, mu, std)
    brake, braking = BrakeSeen(demanded_pa=FULL_PA), Braking(FULL)
    memory = Memory(
        behind, 60 * S, 1.0, brake, braking=braking, seen=100, told_s=30.0, steady=(before, braking), slid=True
    )
    after = judged(CONFIG, memory, lambda: Rail(0.05, 0.04, 0.02))
    assert after.changes == changes
    assert (after.steady is memory.steady) is waits, "what was before is kept for when it is certain"

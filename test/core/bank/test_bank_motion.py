# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How the beliefs move: the means against an integration in time, the covariances against finite differences of it."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from banks import FULL, bank_of
from oracles import specific_resistance
from scipy.integrate import solve_ivp

from adhesion_node.core.bank.labels.kinds import KINDS, RESIDUAL_M, ROUGHNESS_M
from adhesion_node.core.bank.labels.noises import NOISES
from adhesion_node.core.bank.layout import BRAKE, GRADE, MU, OFFSET, POSITION, RADIUS, ROUGH, SIZE, SPEED
from adhesion_node.core.bank.motion import Braking, moved, use
from adhesion_node.core.config import Config
from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.physics.train import CRH3, Array

RISE = 0.004
TRACK = Track((Grade(-1e5, 1e6, RISE * 1.1e6),))
KIND_OF = {kind.name: index for index, kind in enumerate(KINDS)}
FREE_S = {KIND_OF["free"]: 5.0, KIND_OF["steady"]: 7200.0, KIND_OF["other"]: 800.0}
LABELS = list(product(range(len(KINDS)), range(3), range(len(NOISES))))
BRAKINGS = [
    pytest.param(Braking(FULL), id="full"),
    pytest.param(Braking(0.4 * FULL), id="less than the rail gives"),
    pytest.param(Braking(FULL, share=0.4), id="four of ten axles slide, and the rest are hardly pressed"),
    pytest.param(Braking(0.7 * FULL, share=0.4), id="four of ten axles slide"),
    pytest.param(Braking(0.4 * FULL, told=4.0), id="wheels tell of sliding"),
    pytest.param(Braking(0.0), id="released"),
]
LAWS = (
    lambda v: 0.04 + 13.7 / (120.0 + 3.6 * v),  # wet
    lambda v: 0.04 + 13.7 / (120.0 + 3.6 * v) + 2 * (0.04 + 13.7 / (120.0 + 3.6 * 30.0)),  # a third as wet
    lambda v: 1.0,
)


def config_of(rotating: float) -> Config:
    return Config(train=replace(CRH3, rotating_mass_fraction=rotating), track=TRACK, profile_std=0.001)


def rate(x: Array, label: tuple[int, int, int], braking: Braking, rotating: float, slides: bool) -> Array:
    """dx/dt as the equations state it, written anew."""
    kind, law, noise = label
    v, mu, rough, brake, grade = x[SPEED], x[MU], x[ROUGH], x[BRAKE], x[GRADE]
    r = float(specific_resistance(np.array(v))) + RISE
    held = (brake * braking.applied - rotating * r) / (1.0 + rotating)
    share = braking.share
    used = held
    if kind in FREE_S:
        used = mu
    elif slides:  # those that roll bear half as much more at most, on cleaned rail
        used = share * mu * (1.0 + rough) + (1.0 - share) * min(held, 1.5 * mu * (1.0 + rough))
    slowing = 9.8 * (used + r + grade)
    result = np.zeros(SIZE)
    result[POSITION], result[SPEED] = v, -slowing
    if kind in FREE_S:
        result[MU] = -mu / FREE_S[kind]
    elif KINDS[kind].slides:
        bend = (LAWS[law](v + 1e-4) - LAWS[law](v - 1e-4)) / 2e-4 / LAWS[law](v)
        result[MU] = mu * (bend * -slowing + KINDS[kind].growth)
    result[ROUGH] = -rough / 0.7 if KINDS[kind].name in {"swinging", "even", "failing"} else -rough * v / ROUGHNESS_M
    result[GRADE] = -grade * v / RESIDUAL_M
    result[OFFSET] = -x[OFFSET] / NOISES[noise].lasts_s
    return result


def slides_of(kind: int, x: Array, braking: Braking, rotating: float) -> bool:
    r = float(specific_resistance(np.array(x[SPEED]))) + RISE
    needed = (x[BRAKE] * braking.applied - rotating * r) / (1.0 + rotating)
    return KINDS[kind].slides and bool(x[MU] * (1.0 + x[ROUGH]) < needed or braking.told > 0.0)


@pytest.mark.parametrize("rotating", [0.0, 0.08])
@pytest.mark.parametrize("braking", BRAKINGS)
def test_means_follow_the_equations(braking: Braking, rotating: float) -> None:
    kinds, laws, noises = ([label[part] for label in LABELS] for part in range(3))
    start = bank_of(kinds, laws, noises)
    bank, config = start, config_of(rotating)
    for _ in range(250):
        bank = moved(config, bank, 0.004, braking, 1.0)
    for index, label in enumerate(LABELS):
        x = start.mean[index]
        slides = slides_of(label[0], x, braking, rotating)
        exact = solve_ivp(
            lambda _, y, a=label, s=slides: rate(y, a, braking, rotating, s), (0.0, 1.0), x, rtol=1e-9, atol=1e-12
        ).y[:, -1]
        # steps of 4 ms leave errors of half a step times the jerk, 0.15 m/s^3 at most
        assert bank.mean[index] == pytest.approx(exact, rel=2e-4, abs=1e-7), label


def test_a_longest_step_errs_little() -> None:
    # 0.2 s: half a step times the jerk of some 0.02 m/s^3 under the full brake
    kinds = list(range(1, len(KINDS)))
    start = bank_of(kinds, seed=3)
    coarse, fine, config = start, start, config_of(0.0)
    for _ in range(10):
        coarse = moved(config, coarse, 0.2, Braking(FULL), 1.0)
    for _ in range(1000):
        fine = moved(config, fine, 0.002, Braking(FULL), 1.0)
    assert coarse.mean[:, SPEED] == pytest.approx(fine.mean[:, SPEED], abs=0.01)
    assert coarse.mean[:, POSITION] == pytest.approx(fine.mean[:, POSITION], abs=0.02)
    assert coarse.covariance[:, SPEED, SPEED] == pytest.approx(fine.covariance[:, SPEED, SPEED], rel=0.05)


@pytest.mark.parametrize("rotating", [0.0, 0.08])
@pytest.mark.parametrize("braking", BRAKINGS)
def test_linearisation_is_the_derivative_of_the_motion(braking: Braking, rotating: float) -> None:
    """Columns of the step from covariances of one component, against differences of the rates.

    Left out by the linearisation: that roughness, grade and the law fade by the way and speed of this very state.
    """
    dt = 1e-3
    kinds = list(range(len(KINDS)))
    start = bank_of(kinds, noises=[1] * len(kinds), seed=5)
    config = config_of(rotating)
    still = moved(config, start._replace(covariance=np.zeros_like(start.covariance)), dt, braking, 1.0).covariance
    for component in range(SIZE):
        alone = np.zeros_like(start.covariance)
        alone[:, component, component] = 1.0
        outer = moved(config, start._replace(covariance=alone), dt, braking, 1.0).covariance - still
        for index, kind in enumerate(kinds):
            column = outer[index, :, component] / np.sqrt(outer[index, component, component])
            got = (column - np.eye(SIZE)[component]) / dt
            x, h = start.mean[index], np.eye(SIZE)[component] * 1e-5
            slides = slides_of(kind, x, braking, rotating)
            label = (kind, 0, 1)
            above, below = (rate(each, label, braking, rotating, slides) for each in (x + h, x - h))
            expected = (above - below) / 2e-5
            assert got[SPEED] == pytest.approx(expected[SPEED], rel=2e-3, abs=1e-6), (kind, component)
            assert got[POSITION] == pytest.approx(expected[POSITION], rel=1e-3, abs=1e-2), (kind, component)
            assert got[OFFSET] == pytest.approx(expected[OFFSET], rel=1e-3, abs=1e-6), (kind, component)
            if component in {ROUGH, GRADE}:
                assert got[component] == pytest.approx(expected[component], rel=1e-3)


def test_noise_adds_up_to_the_stated_figures() -> None:
    kinds = list(range(len(KINDS)))
    start = bank_of(kinds, noises=[1] * len(kinds), spread=0.0)
    still = start._replace(covariance=np.zeros_like(start.covariance))
    after = moved(config_of(0.0), still, 1e-3, Braking(FULL), 2.0).covariance / 1e-3
    for index, kind in enumerate(KINDS):
        assert after[index, SPEED, SPEED] == pytest.approx(kind.restlessness_mps**2, rel=1e-3)
        assert after[index, POSITION, POSITION] == pytest.approx(0.02**2 / 0.1, rel=1e-3)
        assert after[index, BRAKE, BRAKE] == pytest.approx(0.005**2, rel=1e-3)
        # what fades keeps its variance: 2 sigma^2 per time, or way at 40 m/s
        assert after[index, OFFSET, OFFSET] == pytest.approx(2.0 * 2.0**2 / 30.0, rel=1e-3)
        rough = -(0.025**2) * math.expm1(-2e-3 / 0.7) / 1e-3 if kind.swings else 2.0 * kind.roughness**2 * 40.0 / 100.0
        assert after[index, ROUGH, ROUGH] == pytest.approx(rough, rel=1e-3)
        mu = 2.0 * 0.06**2 / FREE_S[index] if index in FREE_S else (kind.drift * 0.05) ** 2
        assert after[index, MU, MU] == pytest.approx(mu, rel=1e-3)


@pytest.mark.parametrize("steps", [1, 8])
def test_a_night_takes_no_more_away_than_had_been_learnt(steps: int) -> None:
    """Behind 8 hours the brake was known three times worse than by its papers: the first braking claimed nothing."""
    config, bank = config_of(0.0), bank_of([KIND_OF["steady"]], noises=[1], spread=0.0)
    bank.covariance[:, BRAKE, BRAKE], bank.covariance[:, RADIUS, RADIUS] = 0.02**2, 0.004**2
    for _ in range(steps):
        bank = moved(config, bank, 8 * 3600.0 / steps, Braking(0.0), 2.0)
    assert bank.std_of(BRAKE) == pytest.approx(config.brake_error, rel=1e-3)
    assert bank.std_of(RADIUS) == pytest.approx(0.03, rel=0.1)


def test_a_brake_that_is_being_applied_is_known_worse() -> None:
    bank = bank_of([1], spread=0.0)
    config, steady, rising = config_of(0.0), Braking(FULL), Braking(FULL, rising=True)
    more = moved(config, bank, 0.1, rising, 1.0).covariance - moved(config, bank, 0.1, steady, 1.0).covariance
    assert more[0, SPEED, SPEED] == pytest.approx((0.3 * 9.8 * 1.03 * FULL) ** 2 * 0.1, rel=1e-4)
    more[0, SPEED, SPEED] = 0.0
    assert np.all(more == 0.0)


def test_how_cylinders_fill_nobody_tells_where_the_brake_limits() -> None:
    """The force that builds up may be off by a fifth of what it will be; where the rail limits, that does not count."""
    bank = bank_of([1, 2], spread=0.0).with_fresh(MU, 0.02, 0.0)
    config, full, fills = config_of(0.0), Braking(0.3 * FULL), Braking(0.3 * FULL, filling=FULL)
    more = moved(config, bank, 0.1, fills, 1.0).covariance - moved(config, bank, 0.1, full, 1.0).covariance
    assert more[0, SPEED, SPEED] == pytest.approx((0.2 * 9.8 * 1.03 * FULL) ** 2 * 0.1, rel=1e-4)
    assert np.all(more[1] == 0.0)


@pytest.mark.parametrize("braking", BRAKINGS)
def test_the_spread_of_what_is_used_is_that_of_a_sample(braking: Braking) -> None:
    bank = bank_of([0, 1, 2], spread=0.0)
    tight = bank._replace(covariance=1e-4 * bank.covariance)
    rng, config = np.random.default_rng(7), replace(config_of(0.0), used_ripple=0.0)
    used = use(config, tight, braking, np.full(3, 0.004))
    for index in range(3):
        draws = rng.multivariate_normal(tight.mean[index], tight.covariance[index], 4000)
        many = tight.part(np.full(4000, index))._replace(mean=draws)
        values = use(config, many, braking, np.full(4000, 0.004)).value
        assert used.value[index] == pytest.approx(values.mean(), abs=5.0 * values.std() / 63.0 + 1e-9)
        assert used.std(config, tight)[index] == pytest.approx(max(values.std(), 1e-6), rel=0.06)


def test_what_is_used_swings_whether_a_kind_says_so_or_not() -> None:
    bank = bank_of([KIND_OF["smooth"], KIND_OF["swinging"]], spread=0.0)
    known = bank._replace(covariance=np.zeros_like(bank.covariance)).with_fresh(ROUGH, 0.0, np.array([0.0, 0.1]))
    config = replace(config_of(0.0), used_ripple=0.1)
    used = use(config, known, Braking(FULL), np.full(2, 0.004))
    assert used.std(config, known) == pytest.approx(0.1 * used.value, rel=1e-3)

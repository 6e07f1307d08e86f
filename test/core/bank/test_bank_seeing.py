# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What observations do: against the Kalman update of the textbook, and Gaussian densities of scipy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from banks import FULL, bank_of
from numpy_bank import position_seen
from oracles import specific_resistance
from scipy.stats import norm

from adhesion_node.core.bank.kernels.weighing import variances
from adhesion_node.core.bank.layout import BIAS, BRAKE, MU, OFFSET, PITCH, POSITION, ROUGH, SCALE, SIZE, SPEED, Bank
from adhesion_node.core.bank.motion import Braking
from adhesion_node.core.bank.seeing import (
    CLIPPED,
    LEAST_LIKELY,
    PRESSED,
    Observation,
    acceleration_seen,
    corrected,
    fall_seen,
    speed_seen,
    wheels_seen,
)
from adhesion_node.core.config import Config
from adhesion_node.core.physics.train import Array

BANK = bank_of([0, 1, 2, 5], noises=[0, 1, 4, 5], seed=11)
CONFIG = Config()


def textbook(x: Array, p: Array, h: Array, residual: float, r: float) -> tuple[Array, Array, float]:
    """x + K r, Joseph's form of the covariance, and the log density of the residual."""
    s = float(h @ p @ h) + r
    k = p @ h / s
    left = np.eye(SIZE) - np.outer(k, h)
    return x + k * residual, left @ p @ left.T + r * np.outer(k, k), float(norm.logpdf(residual, scale=np.sqrt(s)))


def check(bank: Bank, seen: Observation, rows: list[tuple[Array, float, float]]) -> None:
    """Each row: derivative, residual and variance under a hypothesis."""
    after = corrected(bank, seen)
    densities = []
    for index, (h, residual, r) in enumerate(rows):
        x, p, density = textbook(bank.mean[index], bank.covariance[index], h, residual, r)
        assert after.mean[index] == pytest.approx(x, rel=1e-9, abs=1e-12)
        assert after.covariance[index] == pytest.approx(p, rel=1e-7, abs=1e-12)
        densities.append(density)
    gained = after.log_weight - bank.log_weight
    assert gained - gained[0] == pytest.approx(np.array(densities) - densities[0], abs=1e-9)


def test_a_position() -> None:
    declared = 2.0
    r = [declared**2, 0.06**2, 0.1**2, declared**2]  # 1, 0.03, 0.05, 1 times what is declared
    h = np.zeros(SIZE)
    h[POSITION] = h[OFFSET] = 1.0
    rows = [(h, 503.0 - float(h @ x), r[index]) for index, x in enumerate(BANK.mean)]
    check(BANK, position_seen(BANK, 503.0, declared), rows)


def test_a_speed_with_its_scale() -> None:
    rows = []
    for x in BANK.mean:
        h = np.zeros(SIZE)
        h[SPEED], h[SCALE] = 1.0 + x[SCALE], x[SPEED]
        rows.append((h, 40.3 - (1.0 + x[SCALE]) * x[SPEED], 0.09))
    check(BANK, speed_seen(BANK, 40.3, 0.09), rows)


@pytest.mark.parametrize("share", [1.0, 0.5])
@pytest.mark.parametrize(("rising", "filling"), [(False, 0.0), (True, 0.0), (False, 1.2 * FULL)])
def test_an_accelerometer_with_pitch_and_bias(share: float, rising: bool, filling: float) -> None:
    braking, measured, variance = Braking(FULL, share, rising, filling=filling), -0.8, 0.05**2

    def felt(x: Array, index: int, resisting: float) -> tuple[float, float]:
        held = x[BRAKE] * FULL
        rail = x[MU] * (1.0 + x[ROUGH])
        some = share * rail + (1 - share) * min(held, 1.5 * rail)
        used = (x[MU], held, some, some)[index]
        return -(used + resisting) * (1.0 + x[PITCH]) + x[BIAS], used

    rows = []
    for index, x in enumerate(BANK.mean):
        resisting = float(specific_resistance(np.array(x[SPEED])))  # held fixed: nothing is learnt of the speed
        foreseen, used = felt(x, index, resisting)
        step = 1e-6 * np.eye(SIZE)
        h = np.array([(felt(x + d, index, resisting)[0] - felt(x - d, index, resisting)[0]) / 2e-6 for d in step])
        filled = 0.3 * x[BRAKE] * filling if abs(h[BRAKE]) > 1e-9 else 0.0
        r = variance / 9.8**2 + 0.002**2 + ((0.3 if rising else 1.9 * 0.025) * used) ** 2 + filled**2
        rows.append((h, measured / 9.8 - foreseen, r))
    check(BANK, acceleration_seen(CONFIG, BANK, measured, variance, braking), rows)


def test_the_order_of_positions_does_not_matter() -> None:
    def taken(*places: tuple[float, float]) -> Bank:
        bank = BANK
        for place, declared in places:
            bank = corrected(bank, position_seen(bank, place, declared))
        return bank

    there, back = taken((501.4, 1.0), (501.6, 1.5)), taken((501.6, 1.5), (501.4, 1.0))
    assert there.mean == pytest.approx(back.mean, rel=1e-9)
    assert there.covariance == pytest.approx(back.covariance, rel=1e-7, abs=1e-12)
    assert there.log_weight == pytest.approx(back.log_weight, abs=1e-9)


def test_far_observations_pull_no_harder_than_the_limit() -> None:
    seen = position_seen(BANK, 500.0, 1.0)
    spread = np.sqrt(variances(seen.slope, BANK.covariance) + seen.variances)
    at = {}
    for sigma in (CLIPPED, 10.0, 1e3, 1e6):
        after = corrected(BANK, seen._replace(innovation=sigma * spread))
        at[sigma] = after
        assert np.all(np.linalg.eigvalsh(after.covariance) > 0.0)
    limit = at[CLIPPED].mean - BANK.mean
    for sigma in (10.0, 1e3, 1e6):
        assert at[sigma].mean - BANK.mean == pytest.approx(limit, rel=1e-9, abs=1e-12)
        # evidence falls as of an exponential: by 3.5 per standard deviation
        lost = at[CLIPPED].log_weight - at[sigma].log_weight
        assert lost == pytest.approx(np.full(4, CLIPPED * (sigma - CLIPPED)), rel=1e-9)


def test_evidence_and_pull_are_continuous_at_the_limit() -> None:
    seen = position_seen(BANK, 500.0, 1.0)
    spread = np.sqrt(variances(seen.slope, BANK.covariance) + seen.variances)
    below = corrected(BANK, seen._replace(innovation=(CLIPPED - 1e-9) * spread))
    above = corrected(BANK, seen._replace(innovation=(CLIPPED + 1e-9) * spread))
    assert below.mean == pytest.approx(above.mean, abs=1e-7)
    assert below.log_weight == pytest.approx(above.log_weight, abs=1e-7)
    assert below.covariance == pytest.approx(above.covariance, abs=1e-7)


@pytest.mark.parametrize("told", [4.0, -4.0])
@pytest.mark.parametrize("mu", [0.03, 0.05, 0.09])
@pytest.mark.parametrize("rough", [False, True])
def test_wheels_cut_the_gaussians_where_the_brake_needs_as_much(told: float, mu: float, rough: bool) -> None:
    """Against sums over a grid of adhesion and brake factor: the likelihood is e^(told t) where axles would slide.

    What is not known of the adhesion is that of the rail, or how rough it is just here.
    """
    bank = bank_of([2, 1], spread=0.0).with_fresh(MU, mu, 0.2 * mu * (not rough))
    bank = bank.with_fresh(ROUGH, 0.0, 0.2 * rough).with_fresh(BRAKE, 1.0, 0.1)
    after = wheels_seen(CONFIG, bank, Braking(0.06, told=told), 0.5)
    assert after.log_weight[1] == bank.log_weight[1]  # what limits there is the brake, whatever the rail gives
    assert after.mean[1] == pytest.approx(bank.mean[1])
    rail, factor = np.meshgrid(np.linspace(0.0, 2.5 * mu, 1501), np.linspace(0.4, 1.6, 1201), indexing="ij")
    density = norm.pdf(rail, mu, 0.2 * mu) * norm.pdf(factor, 1.0, 0.1)
    rotating = CONFIG.train.rotating_mass_fraction
    needed = (0.06 * factor - rotating * float(specific_resistance(bank.mean[:1, SPEED])[0])) / (1.0 + rotating)
    slides = needed > 0.9 * rail if told > 0.0 else 0.85 * needed > 1.15 * rail
    likely = density * np.where(slides, np.exp(0.5 * told), 1.0)
    assert after.log_weight[0] - bank.log_weight[0] == pytest.approx(np.log(likely.sum() / density.sum()), abs=2e-3)
    mean = float((likely * rail).sum() / likely.sum())
    component, unit = (ROUGH, mu) if rough else (MU, 1.0)
    assert after.mean[0, MU] + mu * after.mean[0, ROUGH] == pytest.approx(mean, abs=2e-3 * mu)
    std = np.sqrt(float((likely * (rail - mean) ** 2).sum() / likely.sum()))
    assert unit * np.sqrt(after.covariance[0, component, component]) == pytest.approx(std, rel=5e-3)
    both = float((likely * (rail - mean) * factor).sum() / likely.sum())
    assert unit * after.covariance[0, component, BRAKE] == pytest.approx(both, abs=5e-3 * std * 0.1)


TURNING = replace(CONFIG, train=replace(CONFIG.train, rotating_mass_fraction=0.06))


@pytest.mark.parametrize("mu", [0.02, 0.04, 0.06, 0.09])
@pytest.mark.parametrize("fall_mps2", [7.0, 12.0])
def test_rims_that_fall_leave_the_rail_no_more_than_the_rest_of_the_brake(mu: float, fall_mps2: float) -> None:
    """Against sums over a grid of adhesion and brake factor."""
    bank = bank_of([2, 1], spread=0.0).with_fresh(MU, mu, 0.2 * mu).with_fresh(ROUGH, 0.0, 0.0)
    bank = bank.with_fresh(BRAKE, 1.0, 0.1)
    after = fall_seen(TURNING, bank, Braking(0.1, told=8.0), fall_mps2)
    rail, factor = np.meshgrid(np.linspace(0.0, 2.5 * mu, 1501), np.linspace(0.4, 1.6, 1201), indexing="ij")
    density = norm.pdf(rail, mu, 0.2 * mu) * norm.pdf(factor, 1.0, 0.1)
    turned = fall_mps2 / 9.8
    error = math.hypot(TURNING.rotating_mass_std * turned, PRESSED * 0.1)
    likely = density * (LEAST_LIKELY + norm.cdf((0.1 * factor - 0.06 * turned - rail) / error))
    assert after.log_weight[0] - bank.log_weight[0] == pytest.approx(np.log(likely.sum() / density.sum()), abs=2e-3)
    mean = float((likely * rail).sum() / likely.sum())
    assert after.mean[0, MU] == pytest.approx(mean, abs=2e-3 * mu)
    std = math.sqrt(float((likely * (rail - mean) ** 2).sum() / likely.sum()))
    assert math.sqrt(after.covariance[0, MU, MU]) == pytest.approx(std, rel=5e-3)
    assert after.log_weight[1] - bank.log_weight[1] < after.log_weight[0] - bank.log_weight[0]  # all axles roll there


def test_rims_that_fall_a_little_tell_no_more_than_that_they_slide() -> None:
    assert fall_seen(TURNING, BANK, Braking(0.1, told=8.0), 5.0) is BANK
    assert (
        fall_seen(CONFIG, BANK, Braking(0.1, told=8.0), 50.0) is BANK
    )  # of a train whose papers know no rotating mass

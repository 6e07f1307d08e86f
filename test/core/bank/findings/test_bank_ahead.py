# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the bank counts on ahead: quantiles against scipy, means over the way ahead against sampled ways."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from banks import FULL, FULL_PA, NOTHING, SMOOTH, ahead_bank, bank_of, memory_of
from scipy.optimize import brentq
from scipy.stats import norm

from adhesion_node.core.bank.findings.ahead import Ahead, constant, counted_on, quantiles
from adhesion_node.core.bank.findings.verdict import found
from adhesion_node.core.bank.kernels import mixture as mixtures
from adhesion_node.core.bank.kernels import weighing
from adhesion_node.core.bank.labels.kinds import HELD, KINDS, PASSING
from adhesion_node.core.bank.layout import BRAKE, GRADE, MU, ROUGH, SPEED, joined
from adhesion_node.core.bank.motion import Braking, resistance, use
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.physics.braking import curve
from adhesion_node.core.physics.train import CRH3, Array

CONFIG = Config(method="bank")
WANTED = (0.01, 0.025, 0.05, 0.5, 0.975)
FAILING = [kind.name for kind in KINDS].index("failing")


class Mixture(NamedTuple):
    weights: Array
    means: Array
    stds: Array


def mixture(seed: int) -> Mixture:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 12))
    return Mixture(rng.dirichlet(np.ones(count)), rng.uniform(0.0, 0.3, count), 10 ** rng.uniform(-4.0, -1.0, count))


@pytest.mark.parametrize("seed", range(20))
def test_quantiles_are_those_of_the_mixture(seed: int) -> None:
    weights, means, stds = mixture(seed)
    got = quantiles(weights, means, stds, WANTED)
    expected = [
        brentq(lambda x, p=p: float(weights @ norm.cdf(x, means, stds)) - p, -2.0, 2.0, xtol=1e-12) for p in WANTED
    ]
    assert got == pytest.approx(expected, abs=1e-8)
    assert np.all(np.diff(got) >= 0.0)


def test_quantiles_of_several_mixtures_at_once() -> None:
    weights, means, stds = mixture(3)
    rows = quantiles(weights, np.array([means, means + 0.1, 2.0 * means]), np.array([stds, stds, 2.0 * stds]), WANTED)
    alone = quantiles(weights, means, stds, WANTED)
    assert rows == pytest.approx(np.array([alone, alone + 0.1, 2.0 * alone]), abs=1e-8)


@pytest.mark.parametrize("way", [20.0, 300.0, 4000.0])
def test_what_stays_of_a_fading_error_over_the_way(way: float) -> None:
    """The mean of an Ornstein-Uhlenbeck process over a way, given where it starts."""
    length, count, paths = 100.0, 600, 4000
    rng, step = np.random.default_rng(2), way / count
    kept = math.exp(-step / length)
    for start in (0.0, 2.0):
        x, total = np.full(paths, start), np.zeros(paths)
        for _ in range(count):
            following = kept * x + math.sqrt(1.0 - kept**2) * rng.standard_normal(paths)
            total += 0.5 * (x + following) / count
            x = following
        stays, added = mixtures._mean_ahead(way / length)
        error = 4.0 * total.std() / math.sqrt(paths)
        assert total.mean() == pytest.approx(start * stays, abs=error)
        assert total.var() == pytest.approx(added, rel=0.1), start


@pytest.mark.parametrize("mu", [0.01, 0.03, 0.08])
@pytest.mark.parametrize("speed", [4.0, 30.0, 83.0])
def test_ahead_is_counted_on_in_the_braking_curve(mu: float, speed: float) -> None:
    ahead = counted_on(CONFIG, ahead_bank(mu, speed), 0.01, Braking(FULL), NOTHING)
    assert ahead.speed_mps[0] == 0.0
    assert list(ahead.speed_mps) == sorted(ahead.speed_mps)
    assert ahead.speed_mps[-1] == pytest.approx(speed, rel=0.05)
    assert all(0.0 <= low <= 3.0 * mu for low in ahead.mu)
    assert ahead.mu[-1] < min(mu, FULL)
    here = curve(CRH3, speed, ahead.against(CRH3, 0.0))
    # the curve lies between those of its least and of its largest value
    longest, shortest = (curve(CRH3, speed, part(ahead.mu)) for part in (min, max))
    assert shortest.distance_m[-1] - 1e-6 <= here.distance_m[-1] <= longest.distance_m[-1] + 1e-6
    better = curve(CRH3, speed, ahead.at_least(Ahead((0.0,), (0.0,), 0.02)).against(CRH3, 0.0))
    assert better.distance_m[-1] <= here.distance_m[-1] + 1e-9


def test_the_safer_the_longer() -> None:
    bank = ahead_bank(0.05, 50.0)
    lengths = [
        curve(CRH3, 50.0, counted_on(CONFIG, bank, missed, Braking(FULL), NOTHING).against(CRH3, 0.0)).distance_m[-1]
        for missed in (0.5, 0.1, 0.05, 0.01, 0.001)
    ]
    assert lengths == sorted(lengths)


@pytest.mark.parametrize(("share", "counted"), [(1.0, 1.0), (0.5, 0.85 / 1.15)])
def test_rolling_axles_may_slide_under_the_whole_brake(share: float, counted: float) -> None:
    """Under a part of it that is counted on which sliding axles would use; what was known stays."""
    bank = bank_of([1], spread=0.0).with_fresh(GRADE, 0.0, 0.0)
    bank = bank._replace(covariance=1e-8 * bank.covariance)
    config, braking = replace(CONFIG, ahead_std=0.0, grade_std=0.0, resistance_std=0.0), Braking(share * FULL)
    used = float(use(config, bank, braking, resistance(config, bank)).value[0])
    for known in (0.0, 0.2 * FULL, 0.6 * FULL, 3.0 * FULL):
        ahead = counted_on(config, bank, 0.5, braking, Rail(0.05, 0.04, known))
        bears = min(known, FULL) if share < 1.0 else 0.0  # the whole brake shows what it gives
        assert ahead.mu == pytest.approx([max(counted * used, bears)] * 6, rel=0.01)


@pytest.mark.parametrize("factor", [1.0, 0.8])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_no_rail_lets_a_train_brake_harder_than_its_brake(share: float, factor: float) -> None:
    """A heavy one, whose whole brake uses less than is counted on where nothing is known of the rail, or a weak one."""
    bank = bank_of([HELD, SMOOTH], spread=0.0).with_fresh(GRADE, 0.0, 0.0)
    bank.mean[:, BRAKE], bank.mean[:, MU] = factor, 0.3
    bank = bank._replace(covariance=1e-8 * bank.covariance)
    config = replace(CONFIG, ahead_std=0.0, train=replace(CRH3, mass_kg=4.0e6))
    gives = config.train.specific_brake(FULL_PA)
    assert gives < NOTHING.lower
    findings = found(config, memory_of(bank, Braking(share * gives), 3), NOTHING, NOTHING)
    assert max(findings.ahead.mu) <= 1.001 * factor * gives


@pytest.mark.parametrize(
    ("told", "born_s", "odds"),
    [(0.0, -math.inf, 4.0), (-4.0, -math.inf, 1.0), (4.0, -math.inf, 1.0), (0.0, 3.0, 1.0)],
)
def test_what_limits_counts_by_what_is_measured_unless_wheels_tell(told: float, born_s: float, odds: float) -> None:
    """Beforehand a brake that holds is likelier than one under which axles slide: that is no reason for a short way.

    Axles that begin to slide under a steady brake are rare, and were told to be.
    """
    held, slides = (ahead_bank(0.05, 50.0, [kind]) for kind in (HELD, SMOOTH))
    slides = slides._replace(born_s=np.full(slides.kind.size, born_s))
    slides.mean[:, MU] = 0.03
    both = joined([held, slides])._replace(log_weight=np.log([0.99, 0.01]))
    braking, config = Braking(FULL, told=told), replace(CONFIG, ahead_std=0.01)
    missed = 0.5 * odds * 0.01 / (0.99 + odds * 0.01)  # so much lies below the middle of what sliding leaves
    alone = counted_on(config, slides, 0.5, braking, NOTHING)
    assert counted_on(config, both, missed, braking, NOTHING).mu[-1] == pytest.approx(alone.mu[-1], rel=0.03)


@pytest.mark.parametrize(("probability", "counts"), [(0.15, False), (0.25, True)])
def test_a_border_counts_for_the_way_ahead_once_it_is_probable(probability: float, counts: bool) -> None:
    """All three together that say so."""
    steady = ahead_bank(0.05, 50.0, [2])
    passing = ahead_bank(0.01, 50.0, [PASSING])._replace(born_s=np.array([-60.0]))
    both = joined([steady, passing, passing, passing])
    both = both._replace(log_weight=np.log([1.0 - probability, *[probability / 3.0] * 3]))
    aheads = [found(CONFIG, memory_of(bank, Braking(FULL), 3), NOTHING, NOTHING).ahead for bank in (steady, both)]
    assert (max(aheads[1].mu) < 0.5 * min(aheads[0].mu)) == counts
    assert counts or aheads[1].mu == pytest.approx(aheads[0].mu)


@pytest.mark.parametrize(
    ("seconds", "probability", "counts"), [(1.9, 0.08, False), (2.1, 0.08, True), (0.0, 0.12, True)]
)
def test_a_worse_rail_counts_once_it_has_lasted_or_is_probable(
    seconds: float, probability: float, counts: bool
) -> None:
    steady = ahead_bank(0.05, 50.0, [2])._replace(born_s=np.array([-60.0]))
    worse = ahead_bank(0.01, 50.0, [2])._replace(born_s=np.array([10.0 - seconds]))
    both = joined([steady, worse])._replace(log_weight=np.log([1.0 - probability, probability]))
    aheads = [found(CONFIG, memory_of(bank, Braking(FULL), 3), NOTHING, NOTHING).ahead for bank in (steady, both)]
    assert (max(aheads[1].mu) < 0.5 * min(aheads[0].mu)) == counts
    assert counts or aheads[1].mu == pytest.approx(aheads[0].mu)


@pytest.mark.parametrize(("probability", "counts"), [(0.02, False), (0.08, True)])
def test_less_than_hardly_any_rail_gives_counts_once_it_is_likely(probability: float, counts: bool) -> None:
    """Half of `lowest_mu`, 0.02, until one in twenty says less."""
    usual, none = ahead_bank(0.05, 50.0, [SMOOTH]), ahead_bank(0.003, 50.0, [SMOOTH])
    both = joined([usual, none])._replace(log_weight=np.log([1.0 - probability, probability]))
    mu = counted_on(CONFIG, both, 0.01, Braking(FULL), NOTHING).mu[-1]
    assert mu < 0.005 if counts else mu == pytest.approx(0.01)


def test_ahead_is_linear_between_its_speeds_and_constant_beyond() -> None:
    ahead = Ahead((0.0, 10.0, 20.0), (0.06, 0.05, 0.03))
    assert ahead.against(CRH3, 0.0)(np.array([0.0, 5.0, 15.0, 20.0, 90.0])) == pytest.approx(
        [0.06, 0.055, 0.04, 0.03, 0.03]
    )
    assert constant(-1.0).against(CRH3, 0.0)(np.array([0.0, 80.0])) == pytest.approx([0.0, 0.0])


def test_a_train_that_may_be_faster_than_told_counts_on_less() -> None:
    """Known for certain but for its speed, 30 +- 0.6 m/s: against ways drawn from that speed."""
    config = replace(CONFIG, ahead_std=0.0, grade_std=0.0, profile_std=0.0, resistance_std=0.0)
    one = bank_of([SMOOTH], [2], spread=0.0)
    one = one._replace(covariance=np.zeros_like(one.covariance))
    one = (
        one.with_fresh(SPEED, 30.0, 0.6)
        .with_fresh(MU, 0.05, 0.0)
        .with_fresh(ROUGH, 0.0, 0.0)
        .with_fresh(GRADE, 0.0, 0.0)
    )
    ahead = counted_on(config, one, 0.01, Braking(FULL), NOTHING)
    resisting = float(resistance(config, one)[0])
    speeds = 30.0 + 0.6 * np.random.default_rng(4).standard_normal(200_000)
    needed = np.quantile((0.05 + resisting) * (30.0 / speeds) ** 2, 0.01) - resisting
    assert ahead.mu[-1] == pytest.approx(float(needed), rel=0.02)
    assert ahead.mu[-1] < 0.95 * 0.05


@pytest.mark.parametrize(("young", "counts"), [(0.3, False), (0.7, True)])
def test_young_hypotheses_count_once_they_prevail_together(young: float, counts: bool) -> None:
    """Nine of each, none of them likely by itself: of the young ones none below a half, all of them above."""
    weight = np.repeat([(1.0 - young) / 9.0, young / 9.0], 9)
    age_s, kind = np.repeat([10.0, 0.5], 9), np.full(18, SMOOTH)
    kept = np.exp(weighing.borne_out(np.log(weight), age_s, kind, 2.0, 0.1, PASSING, 0.2))
    assert kept[9:].sum() == pytest.approx(young if counts else 0.0)


@pytest.mark.parametrize(("probability", "counts"), [(0.65, False), (0.75, True)])
def test_a_rail_that_goes_on_failing_is_counted_on_to_once_it_surely_does(probability: float, counts: bool) -> None:
    """By 0.6 % a second: over a stop from 50 m/s at 0.5 m/s^2 a sixth is lost in the mean of the way."""
    steady, failing = (ahead_bank(0.05, 50.0, [kind]) for kind in (SMOOTH, FAILING))
    shares = np.log([1.0 - probability]), np.log([probability])
    both, without = (
        joined([bank._replace(log_weight=share) for bank, share in zip((steady, other), shares, strict=True)])
        for other in (failing, steady)
    )
    config = replace(CONFIG, ahead_std=0.0)
    middle, same = (counted_on(config, bank, 0.3, Braking(FULL), NOTHING).mu[-1] for bank in (both, without))
    assert (middle < 0.92 * same) == counts

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The compiled loops of the bank: against NumPy to rounding, and that nothing is compiled while a train brakes."""

from __future__ import annotations

import itertools
from dataclasses import replace
from importlib import import_module
from itertools import product
from pkgutil import iter_modules

import numpy as np
import numpy_ahead
import numpy_bank as by_numpy
import numpy_branching
import pytest
from banks import FULL, bank_of

from adhesion_node.core.bank import branching, kernels, motion, seeing
from adhesion_node.core.bank.findings.ahead import FAILS, counted_on, quantiles
from adhesion_node.core.bank.kernels import parabola, weighing
from adhesion_node.core.bank.labels.kinds import GROWTH, HELD, KINDS, PASSING, SLIDES
from adhesion_node.core.bank.labels.noises import NOISES
from adhesion_node.core.bank.layout import BRAKE, Bank
from adhesion_node.core.bank.motion import Braking
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.estimator import warm_up
from adhesion_node.core.physics.track import Grade, Track, Tunnel
from adhesion_node.core.physics.train import CRH3

LABELS = list(product(range(len(KINDS)), range(3), range(len(NOISES))))
KIND, LAW, NOISE = ([label[part] for label in LABELS] for part in range(3))
BANK = bank_of(KIND, LAW, NOISE, spread=1.0)
TRACK = Track((Grade(0.0, 499.0, 5.0), Tunnel(499.5, 900.0), Grade(500.5, 2000.0, -8.0)))
CONFIGS = [Config(), Config(train=replace(CRH3, rotating_mass_fraction=0.08), track=TRACK)]
BRAKINGS = [
    *(Braking(FULL), Braking(0.4 * FULL, 0.6, True, 0.0), Braking(0.5 * FULL, 1.0, False, 4.0), Braking(0.0)),
    Braking(0.2 * FULL, filling=FULL),
    Braking(0.3 * FULL, alone=True),
]
MODULES = [import_module(f"{kernels.__name__}.{each.name}") for each in iter_modules(kernels.__path__)]


def check(ours: Bank, theirs: Bank) -> None:
    """Equal but for rounding; as covariances cancel, by the size of their variances."""
    for one, other in zip(ours[3:], theirs[3:], strict=True):
        np.testing.assert_array_equal(one, other)
    std = np.sqrt(np.maximum(np.einsum("hii->hi", theirs.covariance), 1e-12))
    np.testing.assert_allclose(ours.mean, theirs.mean, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(
        ours.covariance / (std[:, :, None] * std[:, None, :]),
        theirs.covariance / (std[:, :, None] * std[:, None, :]),
        atol=1e-12,
    )
    np.testing.assert_allclose(ours.log_weight, theirs.log_weight, atol=1e-11)


@pytest.mark.parametrize("config", CONFIGS, ids=["level", "profile and rotating mass"])
@pytest.mark.parametrize("braking", BRAKINGS)
def test_a_step(config: Config, braking: Braking) -> None:
    check(motion.moved(config, BANK, 0.17, braking, 1.3), by_numpy.moved(config, BANK, 0.17, braking, 1.3))
    resisting = motion.resistance(config, BANK)
    ours, theirs = (form.use(config, BANK, braking, resisting) for form in (motion, by_numpy))
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("braking", [Braking(0.0), Braking(FULL), Braking(FULL, alone=True)])
def test_a_brake_that_is_stronger_than_it_can_be(braking: Braking) -> None:
    mean, covariance = BANK.mean.copy(), BANK.covariance.copy()
    mean[::2, BRAKE], covariance[::3, BRAKE, BRAKE] = 1.4, 0.3
    strong = BANK._replace(mean=mean, covariance=covariance)
    check(motion.moved(Config(), strong, 0.1, braking, 1.0), by_numpy.moved(Config(), strong, 0.1, braking, 1.0))


def test_a_speed_below_0_and_a_standstill() -> None:
    mean = BANK.mean.copy()
    mean[::2, 1], mean[1::2, 1] = -0.3, 0.0
    slow = BANK._replace(mean=mean)
    check(motion.moved(Config(), slow, 0.1, BRAKINGS[0], 1.0), by_numpy.moved(Config(), slow, 0.1, BRAKINGS[0], 1.0))


@pytest.mark.parametrize("position_m", [500.0, 503.0, 540.0], ids=["near", "off", "clipped"])
def test_a_correction(position_m: float) -> None:
    seen = by_numpy.position_seen(BANK, position_m, 1.3)
    check(seeing.corrected(BANK, seen), by_numpy.corrected(BANK, seen))
    one = seen._replace(variance=0.4)
    check(seeing.corrected(BANK, one), by_numpy.corrected(BANK, one))
    before = BANK.mean, BANK.covariance, BANK.log_weight
    white = motion.white_variances(1.3)
    *beliefs, total = weighing.placed(*before, BANK.noise, white, position_m, seeing.CLIPPED)
    check(BANK.believing(*beliefs), by_numpy.normalised(by_numpy.corrected(BANK, seen)))
    assert total == pytest.approx(float(np.logaddexp.reduce(by_numpy.corrected(BANK, seen).log_weight)), rel=1e-12)


@pytest.mark.parametrize("position_m", [500.0, 540.0])
def test_how_far_a_position_is_off(position_m: float) -> None:
    ours = motion.foreseen(CONFIGS[1], BANK, 0.17, BRAKINGS[1], 0.9, position_m, motion.white_variances(1.3))
    bank = motion.moved(CONFIGS[1], BANK, 0.17, BRAKINGS[1], 0.9)
    assert ours.bank is not None
    for one, other in zip(ours.bank, bank, strict=True):
        np.testing.assert_array_equal(one, other)
    seen = by_numpy.position_seen(bank, position_m, 1.3)
    variance = np.einsum("hi,hij,hj->h", seen.slope, bank.covariance, seen.slope) + seen.variance
    mean = float(bank.weight @ seen.innovation)
    spread = float(bank.weight @ (variance + np.square(seen.innovation - mean)))
    nearest = float((np.abs(seen.innovation) / np.sqrt(variance)).min())
    assert (ours.metres, ours.std_m, ours.nearest) == pytest.approx((mean, np.sqrt(spread), nearest), rel=1e-12)


@pytest.mark.parametrize("held", [HELD, PASSING])
def test_whether_the_rail_has_changed(held: int) -> None:
    bank = BANK._replace(changed_s=np.resize(np.linspace(0.0, 9.0, 10), BANK.kind.size)).normalised()
    found = weighing.changing(bank.log_weight, bank.changed_s, bank.kind, SLIDES, 6.5, PASSING, held)
    passing = bank.kind == PASSING
    each = (bank.changed_s > 6.5) | passing | (bank.kind == held), passing, SLIDES[bank.kind]
    assert found == pytest.approx([float(bank.weight @ one) for one in each], rel=1e-12)


def test_weights_that_may_come_back() -> None:
    weight = np.exp(weighing.normalised(np.array([0.0, -30.0, -1.0]), -5.0))
    before = np.array([1.0, 0.0, np.exp(-1.0)]) / (1.0 + np.exp(-30.0) + np.exp(-1.0))
    before[1] = np.exp(-5.0)
    np.testing.assert_allclose(weight, before / before.sum(), rtol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_pruning(seed: int) -> None:
    """Some far less likely than others, some alike, and once more than may stay."""
    rng, count = np.random.default_rng(seed), 150
    kind, law, noise = (rng.integers(0, size, count).tolist() for size in (6, 3, 4 if seed % 2 else 1))
    bank = bank_of(kind, law, noise, seed, spread=0.05 * (1 + seed))
    bank = by_numpy.normalised(bank._replace(log_weight=rng.uniform(-9.0 if seed % 3 else -3.0, 0.0, count)))
    ours = branching.pruned(bank)
    check(ours, numpy_branching.pruned(bank))
    assert ours.log_weight.size < count
    for one, other in zip(bank.moments(), by_numpy.moments(bank), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("braking", BRAKINGS)
@pytest.mark.parametrize("config", CONFIGS, ids=["level", "profile and rotating mass"])
def test_what_springs_from_others(config: Config, braking: Braking) -> None:
    """Of every kind, those with less than 3 % aside."""
    for seed in range(4):
        chosen = np.random.default_rng(seed).choice(BANK.log_weight.size, 25, replace=False)
        bank = by_numpy.normalised(BANK.part(np.sort(chosen)))
        told = braking._replace(told=(-4.0, 0.0, 4.0)[seed % 3])
        check(
            branching.branched(config, bank, told, 77.5, 0.5), numpy_branching.branched(config, bank, told, 77.5, 0.5)
        )


@pytest.mark.parametrize("shape", [(40,), (6, 40)])
def test_quantiles(shape: tuple[int, ...]) -> None:
    """Of narrow and wide parts, also far apart: where nothing lies between them as well."""
    rng = np.random.default_rng(3)
    for spread in (0.0, 0.01, 1.0):
        weights = rng.dirichlet(np.full(shape[-1], 0.3))
        means, stds = rng.normal(0.08, spread, shape), rng.uniform(1e-6, 0.02, shape)
        wanted = (0.01, 0.05, 0.5, 0.975)
        ours = quantiles(weights, means, stds, wanted)
        assert ours.shape == (*shape[:-1], 4)
        np.testing.assert_allclose(ours, numpy_ahead.quantiles(weights, means, stds, wanted), rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("braking", BRAKINGS)
@pytest.mark.parametrize("config", CONFIGS, ids=["level", "profile and rotating mass"])
@pytest.mark.parametrize("fails", [False, True])
def test_what_is_counted_on_ahead(config: Config, braking: Braking, fails: bool) -> None:
    weight = np.where(GROWTH[BANK.kind] < 0.0, 5.0 if fails else 0.0, 0.0)
    bank = BANK._replace(log_weight=BANK.log_weight + weight).normalised()
    assert (float(bank.weight @ (GROWTH[bank.kind] < 0.0)) > FAILS) == fails
    for known, missed in itertools.product((0.0, 0.06), (0.02, 1e-5)):
        rail = Rail(0.07, 0.02, known)
        ours = counted_on(config, bank, missed, braking, rail)
        speeds, mu = numpy_ahead.counted_on(config, bank, missed, braking, rail)
        np.testing.assert_allclose(ours.speed_mps, speeds, rtol=1e-12)
        np.testing.assert_allclose(ours.mu, mu, rtol=1e-7 if fails else 1e-9)


def test_the_curvature_of_a_parabola_through_places() -> None:
    time = np.sort(np.random.default_rng(4).uniform(-3.0, 0.0, 30))
    places = 3.0 - 40.0 * time - 0.7 * time**2 + np.sin(20.0 * time)
    assert parabola.curvature(time, places) == pytest.approx(np.polyfit(time, places, 2)[0], rel=1e-9)


def test_all_is_compiled_before_a_train_brakes() -> None:
    """Whatever is measured, by whatever sensors, calls the kernels with the types of the warm-up."""
    warm_up(Config())
    kernels_by_name = (item for module in MODULES for item in vars(module).items() if hasattr(item[1], "signatures"))
    entries = [each for name, each in kernels_by_name if not name.startswith("_")]  # the others are called by these
    once = {each: each.signatures for each in entries}
    assert {len(signatures) for signatures in once.values()} == {1}
    for config in CONFIGS:
        warm_up(replace(config, speed_source="doppler", pressure_kind="mean"))
        warm_up(replace(config, max_lag_s=1.0, method="rail_condition"))
    assert once == {each: each.signatures for each in entries}

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The method `rail_condition` over whole brakings of an independent integrator: calibration, outliers, patches."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from journeys import LIMIT, Journey, Rail, braking, wet
from oracles import drive
from windowed import windowed

from adhesion_node.core import Config, Estimate, Regime
from adhesion_node.core.methods.rail_condition.method import ConditionWindow
from adhesion_node.core.physics.adhesion import SNOW, WET

LAW_KNOWN = windowed(law_probability=1.0, step=10)
QUANTILE = 1.6448536269514722
"""Of the normal law at the configured 95 %."""


def _estimates(config: Config, journey: Journey) -> list[Estimate]:
    """Those of the braking."""
    return [estimate for estimate in drive(config, journey.measurements)[1] if estimate.window]


def test_errors_are_as_large_as_their_standard_deviations_say() -> None:
    """Several windows overlap before the last: measurements counted twice would halve the standard deviation."""
    config = replace(LAW_KNOWN, tail_dof=0.0, change_threshold=50.0)
    adhesion, speed, kept = [], [], []
    for seed in range(60):
        kappa = float(np.random.default_rng(1000 + seed).uniform(0.5, 1.0))
        journey = braking(wet(kappa), 12.0, seed)
        last = _estimates(config, journey)[-1]
        true_speed = journey.speed_mps[round(last.t_ns / 1e8)]
        adhesion.append((last.mu - journey.truth(last.t_ns)) / last.mu_std)
        speed.append((last.speed_mps - true_speed) / last.speed_std_mps)
        kept.append(last.mu_lower <= journey.truth(last.t_ns))
    for errors in (adhesion, speed):
        assert 0.75 < np.std(errors) < 1.35
        assert abs(np.mean(errors)) < 0.45
    assert np.mean(kept) >= 0.88
    assert last.mu_std < 0.02 * last.mu


def test_outliers_of_20_m_change_little() -> None:
    journey, rng = braking(wet(), 20.0, 1), np.random.default_rng(0)
    jumps = np.where(rng.random(len(journey.measurements)) < 0.05, rng.choice([-20.0, 20.0], 250), 0.0)
    wild = [m._replace(position_m=m.position_m + d) for m, d in zip(journey.measurements, jumps, strict=True)]
    assert np.count_nonzero(jumps) > 8
    ungated = windowed(gate_sigma=1e6)  # so that the tails have to do it alone
    clean, tails = (_estimates(ungated, journey._replace(measurements=m)) for m in (journey.measurements, wild))
    for before, after in zip(clean[15:], tails[15:], strict=True):
        assert abs(after.mu - before.mu) < 3.0 * before.mu_std
        assert after.changes == 0
    gauss = _estimates(replace(ungated, tail_dof=0.0), journey._replace(measurements=wild))
    assert abs(gauss[-1].mu - clean[-1].mu) > 5.0 * clean[-1].mu_std


@pytest.mark.parametrize("seed", range(3))
def test_a_patch_is_found_within_seconds_and_counted(seed: int) -> None:
    """A wet rail falls to 0.45 of itself 12 s after the brakes came, at 17 s."""
    journey = braking(lambda t, v: wet(0.45 if t > 12.0 else 1.0)(t, v), 20.0, seed)
    estimates = _estimates(windowed(), journey)
    assert all(e.changes == 0 for e in estimates if e.t_ns < 17e9)
    found = [e for e in estimates if e.changes]
    assert found[0].t_ns < 22e9
    assert all(e.changes == 1 for e in found)
    for estimate in found:
        assert abs(estimate.mu - journey.truth(estimate.t_ns)) < 3.5 * estimate.mu_std
        assert estimate.mu_lower < journey.truth(estimate.t_ns)
    assert found[-1].mu == pytest.approx(journey.truth(found[-1].t_ns), rel=0.15)
    assert found[-1].mu_std < 0.25 * found[0].mu_std


def test_a_step_of_the_positions_is_no_change_of_the_rail() -> None:
    """A balise corrects the odometry 12 s after the brakes came, at any of the samples between two windows."""
    for seed in range(6):
        journey, first = braking(wet(), 15.5, seed), 170 + seed % 5
        plain = _estimates(windowed(), journey)
        for size_m in (2.0, -2.0):
            later = [m._replace(position_m=m.position_m + size_m) for m in journey.measurements[first:]]
            stepped = _estimates(windowed(), journey._replace(measurements=journey.measurements[:first] + later))
            for before, after in zip(plain, stepped, strict=True):
                assert after.changes == 0
                assert abs(after.mu - before.mu) < 2.0 * max(before.mu_std, after.mu_std)
                assert 0.9 * before.mu_lower <= after.mu_lower <= max(journey.truth(after.t_ns), before.mu_lower)
            moved = stepped[-1].position_m - plain[-1].position_m
            assert moved == pytest.approx(size_m, abs=3.0 * stepped[-1].position_std_m)


def test_a_steady_rail_has_no_changes() -> None:
    for seed in range(3):
        assert _estimates(windowed(), braking(wet(), 25.0, seed))[-1].changes == 0


@pytest.mark.parametrize("pressure_pa", [410e3, 200e3])
def test_a_limited_brake_claims_no_more_than_it_uses(pressure_pa: float) -> None:
    journey, limit = braking(lambda _, v: 0.14, 15.0, 2, pressure_pa=pressure_pa), LIMIT * pressure_pa / 410e3
    estimates = _estimates(windowed(), journey)
    known = float(SNOW(np.array(journey.speed_mps[-1])))
    assert estimates[-1].regime is Regime.BRAKE_LIMITED
    for estimate in estimates:
        if estimate.regime is not Regime.COASTING:
            assert estimate.regime is Regime.BRAKE_LIMITED
            assert estimate.mu_lower <= max(limit, known) + 1e-4
    # a weak brake leaves what was known before: the low-adhesion law with a standard deviation of 0.04
    assert limit - 1e-4 < estimates[-1].mu < max(limit, 0.055) + 1e-4
    assert estimates[-1].mu_lower > 0.85 * limit


@pytest.mark.parametrize("seed", range(4))
def test_a_braking_begins_with_the_bound_that_was_known(seed: int) -> None:
    """The low-adhesion law, which the first seconds neither confirm nor refute, until the rail has been seen."""

    def bounds(rail: Rail) -> list[float]:
        estimates = _estimates(windowed(), braking(rail, 6.0, seed))
        return [estimate.mu_lower / float(SNOW(np.array(estimate.speed_mps))) for estimate in estimates]

    better, worse = bounds(wet()), bounds(wet(0.4))
    assert 0.95 < better[0] < 1.05
    assert min(better) > 0.9
    assert better[-1] > 1.3
    assert worse[-1] < 0.6


def test_a_limited_brake_hands_on_no_knowledge_of_the_adhesion() -> None:
    """Only that it is not below: else the windows to come would take the limit for the adhesion."""
    open_rail, seen_rail = (braking(rail, 15.0, 2) for rail in (lambda _, v: 0.14, wet(0.8)))
    for journey, low, high in ((open_rail, 0.03, 0.05), (seen_rail, 0.0, 0.002)):
        window = drive(windowed(), journey.measurements)[0].window
        assert isinstance(window, ConditionWindow)
        assert low < math.sqrt(window.hypotheses[0].variance) < high


def test_where_the_search_starts_does_not_matter() -> None:
    """The second rail is at the brake's limit from 128 km/h on."""
    for journey in (braking(wet(0.8), 8.0, 4), braking(wet(), 14.0, 4, speed_mps=44.0)):
        one, *others = (_estimates(windowed(start_mu=start), journey) for start in (0.05, 0.0, 0.12))
        for other in others:
            for expected, estimate in zip(one, other, strict=True):
                assert estimate.mu == pytest.approx(expected.mu, abs=0.05 * expected.mu_std)
                assert estimate.mu_lower == pytest.approx(expected.mu_lower, abs=0.05 * expected.mu_std)
                assert estimate.regime is expected.regime


def test_an_uncertain_grade_adds_in_quadrature() -> None:
    journey = braking(wet(), 10.0, 5)
    sure, unsure = (_estimates(replace(LAW_KNOWN, grade_std=std), journey)[-1] for std in (0.0, 0.003))
    assert unsure.mu == sure.mu
    assert unsure.mu_std == pytest.approx(math.hypot(sure.mu_std, 0.003))
    assert unsure.mu_lower == pytest.approx(sure.mu - QUANTILE * unsure.mu_std)
    assert sure.mu_lower == pytest.approx(sure.mu - QUANTILE * sure.mu_std)


def test_a_grade_that_was_not_told_stays_within_its_standard_deviation() -> None:
    """6 permille downhill are read as so much less adhesion, neither more nor less."""
    journey = braking(wet(0.8), 10.0, 5, grade=-0.006)
    level, last = (_estimates(LAW_KNOWN, j)[-1] for j in (braking(wet(0.8), 10.0, 5), journey))
    assert last.mu == pytest.approx(level.mu - 0.006, abs=3e-4)
    assert abs(last.mu - journey.truth(last.t_ns)) > 3.0 * last.mu_std
    unsure = _estimates(replace(LAW_KNOWN, grade_std=0.004), journey)[-1]
    assert abs(unsure.mu - journey.truth(unsure.t_ns)) < 2.0 * unsure.mu_std


@pytest.mark.parametrize(
    "uncertain",
    [windowed(step=10, brake_std=0.05), windowed(step=10, mass_std=0.05), windowed(step=10, rotating_mass_std=0.05)],
    ids=["brake", "mass", "rotating mass"],
)
def test_an_uncertain_brake_widens_the_bound_only_where_it_limits(uncertain: Config) -> None:
    config = windowed(step=10)
    limited, sliding = braking(lambda _, v: 0.14, 12.0, 6), braking(wet(0.7), 12.0, 6)
    sure, unsure = (_estimates(each, limited)[-1] for each in (config, uncertain))
    assert unsure.regime is sure.regime is Regime.BRAKE_LIMITED
    # at most as if both standard deviations added up, at least the brake's alone
    assert LIMIT * (1.0 - QUANTILE * 0.05) - (LIMIT - sure.mu_lower) <= unsure.mu_lower
    assert unsure.mu_lower <= LIMIT * (1.0 - QUANTILE * 0.05) + 1e-4
    free, doubted = (_estimates(each, sliding)[-1] for each in (config, uncertain))
    assert free.regime is doubted.regime is Regime.ADHESION_LIMITED
    assert doubted[:4] == free[:4]


@pytest.mark.parametrize(
    ("rail", "shape"),
    [
        (lambda _, v: 0.07, None),
        (lambda _, v: 0.03 + 8.0 / (130.0 + 3.6 * v), SNOW),
        (wet(0.8), WET),
    ],
    ids=["constant", "snow", "wet"],
)
def test_the_shape_of_the_law_is_recognised(rail: Rail, shape: object) -> None:
    """A hundred km/h tell them apart, where each weighs the same at first."""
    journey = braking(rail, 40.0, 3, sigma_m=0.3)
    last = _estimates(windowed(step=10, law_probability=1.0 / 3.0), journey)[-1]
    assert last.shape is not None
    assert last.shape == shape if shape else last.shape.gain_kmh == 0.0
    assert abs(last.mu - journey.truth(last.t_ns)) < 3.5 * last.mu_std
    assert last.mu_std < 0.03 * last.mu


def test_a_patch_that_the_brakes_limit_hid_is_not_taken_for_better_than_it_is() -> None:
    """Below 128 km/h the wet rail gives more than the brake uses; the patch of 0.45 is found from the limit down."""
    errors, kept = [], []
    for seed in range(6):
        journey = braking(lambda t, v: wet(0.45 if t > 38.0 else 1.0)(t, v), 46.0, seed, speed_mps=60.0)
        after = [e for e in _estimates(windowed(step=10), journey) if e.changes and e.t_ns > 47e9]
        assert after
        errors += [(e.mu - journey.truth(e.t_ns)) / e.mu_std for e in after]
        kept += [e.mu_lower <= journey.truth(e.t_ns) for e in after]
    assert abs(np.mean(errors)) < 0.7
    assert np.mean(kept) >= 0.75

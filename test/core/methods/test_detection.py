# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Steps of the positions are rare: what a wheel that slides or a slow error of the positions does is none."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from journeys import Journey, braking, wet
from oracles import Array
from windowed import windowed

from adhesion_node.core import Config, Estimate, State, finish, init, step
from adhesion_node.core.methods.rail_condition.method import ConditionWindow

CREEP = 0.1
"""Of the axle whose turns give the positions, while it slides."""


class Ride(NamedTuple):
    """What an estimator gave, and where the positions took a step, as it saw them."""

    state: State
    estimates: list[Estimate]
    stepped_m: list[float]


def ride(config: Config, journey: Journey) -> Ride:
    """The estimator through a whole journey."""
    state, estimates, stepped_m = init(config, 1), list[Estimate](), list[float]()
    for measurement in journey.measurements:
        state, estimate = step(config, state, measurement)
        estimates += [] if estimate is None else [estimate]
        seen_m = state.window.stepped_m if isinstance(state.window, ConditionWindow) else -math.inf
        if math.isfinite(seen_m) and seen_m not in stepped_m:
            stepped_m.append(seen_m)
    state, last = finish(config, state)
    return Ride(state, [*estimates, *last], stepped_m)


def moved(journey: Journey, by_m: Array) -> Journey:
    """The journey with its positions moved; their variance does not tell."""
    pairs = zip(journey.measurements, by_m, strict=True)
    return journey._replace(measurements=[m._replace(position_m=m.position_m + float(d)) for m, d in pairs])


def lost_by_sliding(journey: Journey, seed: int, mean_s: float) -> Array:
    """What positions from the turns of an axle lose, m: under the brake it slides and rolls by turns."""
    rng, lost_m, sliding = np.random.default_rng(seed), np.zeros(len(journey.measurements)), False
    left_s = rng.exponential(mean_s)
    for k in range(1, lost_m.size):
        left_s -= 0.1
        if k >= 50 and left_s < 0.0:
            sliding, left_s = not sliding, rng.exponential(mean_s)
        lost_m[k] = lost_m[k - 1] - 0.1 * CREEP * sliding * journey.speed_mps[k]
    return lost_m


def wandering(count: int, seed: int, std_m: float = 2.0, time_s: float = 5.0) -> Array:
    """A slow error of the positions, a first-order Markov process."""
    rng, kept = np.random.default_rng(seed), math.exp(-0.1 / time_s)
    error = np.empty(count)
    error[0] = std_m * rng.standard_normal()
    for k in range(1, count):
        error[k] = kept * error[k - 1] + std_m * math.sqrt(1.0 - kept**2) * rng.standard_normal()
    return error


@pytest.mark.parametrize(
    ("mean_s", "seed"), [(10.0, 2), (10.0, 3), (3.0, 5), (3.0, 7), (3.0, 110), (3.0, 300), (10.0, 300)]
)
def test_the_speed_stays_with_positions_from_an_axle_that_slides(mean_s: float, seed: int) -> None:
    """Its lost way, taken for steps, hid that the speed was wrong: at 12 m/s, 40 were published."""
    clean = braking(wet(), 90.0, seed, sigma_m=0.3)
    estimates = ride(windowed(), moved(clean, lost_by_sliding(clean, seed + 1000, mean_s))).estimates[12:]
    errors = []
    for estimate in estimates:
        true_mps = max(clean.speed_mps[round(estimate.t_ns / 1e8)], 0.0)
        # between the axle's own speed and the train's, both are right
        errors.append(estimate.speed_mps - np.clip(estimate.speed_mps, (1.0 - CREEP) * true_mps, true_mps))
    assert np.sqrt(np.mean(np.square(errors))) < 1.0
    assert np.max(np.abs(errors)) < 5.0


@pytest.mark.parametrize("seed", [301, 302, 303])
def test_a_slow_error_of_the_positions_moves_the_speed_no_further_than_itself(seed: int) -> None:
    """2 m that change within 5 s, declared as white 0.3 m."""
    clean = braking(wet(), 85.0, seed, sigma_m=0.3)
    estimates = ride(windowed(), moved(clean, wandering(len(clean.measurements), seed))).estimates[12:]
    errors = np.array([e.speed_mps - max(clean.speed_mps[round(e.t_ns / 1e8)], 0.0) for e in estimates])
    assert np.sqrt(np.mean(errors**2)) < 1.25
    assert np.mean(np.abs(errors) < 3.0 * np.array([e.speed_std_mps for e in estimates])) > 0.35


@pytest.mark.parametrize("seed", range(31, 35))
@pytest.mark.parametrize("slides", [True, False])
def test_two_steps_of_the_positions_lie_a_distance_apart(seed: int, slides: bool) -> None:
    config, clean = windowed(position_step_spacing_m=700.0), braking(wet(), 80.0, seed, sigma_m=0.3)
    error = lost_by_sliding(clean, seed, 10.0) if slides else wandering(len(clean.measurements), seed)
    stepped_m = ride(config, moved(clean, error)).stepped_m
    assert stepped_m
    assert all(after - before > 0.99 * 700.0 for before, after in pairwise(stepped_m))


def test_balises_that_correct_the_positions_are_still_steps() -> None:
    clean = braking(wet(), 60.0, 4, sigma_m=0.3)
    passed = np.floor(np.cumsum(0.1 * clean.speed_mps) / 600.0)
    ridden = ride(windowed(), moved(clean, 2.5 * (passed % 2)))
    assert len(ridden.stepped_m) == np.max(passed)
    for estimate in ridden.estimates:
        assert estimate.changes == 0
        true_mps = clean.speed_mps[round(estimate.t_ns / 1e8)]
        assert abs(estimate.speed_mps - true_mps) < max(4.0 * estimate.speed_std_mps, 0.8)

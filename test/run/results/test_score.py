# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The score of a run: hand-computed, and which estimates count."""

from __future__ import annotations

import pytest

from adhesion_node.core import Config, Estimate, Regime
from adhesion_node.run.results.score import Truth, mean_relative_error_percent

S = 10**9
FULL_PA = 410e3
"""Brakes with B/(M g) = 0.0952."""

CONFIG = Config()


def truth_of(*rows: tuple[float, float, float]) -> Truth:
    """Build a truth from (mu, speed in km/h, gauge pressure), a row per second."""
    truth = Truth()
    for second, (mu, speed_kmh, pressure_pa) in enumerate(rows):
        truth.mu[second * S] = mu
        truth.speed_mps[second * S] = speed_kmh / 3.6
        truth.pressure_pa[second * S] = pressure_pa
    return truth


def at(second: int, mu: float, regime: Regime = Regime.ADHESION_LIMITED) -> Estimate:
    return Estimate(second * S, mu, 0.01, mu, regime, 0.0, 0.0, 0.1, 0.1)


def real_truth(*rows: tuple[float, float, bool]) -> Truth:
    """Build the truth of a real train from (used, speed in km/h, limited), a row per second."""
    return Truth(
        mu={second * S: used for second, (used, _, _) in enumerate(rows)},
        speed_mps={second * S: kmh / 3.6 for second, (_, kmh, _) in enumerate(rows)},
        limited={second * S: limited for second, (_, _, limited) in enumerate(rows)},
    )


BRAKING = truth_of(
    (0.080, 300, 0.0),
    (0.080, 300, FULL_PA),  # the first braking: estimates count below 270 km/h
    (0.080, 280, FULL_PA),
    (0.080, 260, FULL_PA),
    (0.100, 250, FULL_PA),  # more than the brake uses
    (0.090, 240, FULL_PA),
    (0.090, 230, 0.0),
)


def test_a_hand_computed_run() -> None:
    estimates = [at(3, 0.084), at(5, 0.081)]  # 5 % above, 10 % below
    assert mean_relative_error_percent(CONFIG, BRAKING, estimates) == pytest.approx(7.5)


@pytest.mark.parametrize("second", [0, 1, 2, 4, 6, 7])
def test_what_does_not_count(second: int) -> None:
    """Cruising, the first 30 km/h, the brake's limit, a released brake, a time without truth."""
    assert mean_relative_error_percent(CONFIG, BRAKING, [at(second, 0.5)]) is None
    assert mean_relative_error_percent(CONFIG, BRAKING, [at(second, 0.5), at(3, 0.084)]) == pytest.approx(5.0)


@pytest.mark.parametrize("regime", list(Regime))
def test_an_estimate_counts_whatever_regime_it_claims(regime: Regime) -> None:
    assert mean_relative_error_percent(CONFIG, BRAKING, [at(3, 0.072, regime)]) == pytest.approx(10.0)


def test_half_a_brake_limits_more() -> None:
    """Half the pressure uses 0.0476: a rail of 0.08 cannot be seen."""
    half = truth_of((0.08, 300, 0.0), (0.08, 300, FULL_PA), (0.08, 260, FULL_PA / 2), (0.04, 250, FULL_PA / 2))
    assert mean_relative_error_percent(CONFIG, half, [at(2, 0.5)]) is None
    assert mean_relative_error_percent(CONFIG, half, [at(2, 0.5), at(3, 0.05)]) == pytest.approx(25.0)


@pytest.mark.parametrize(("force", "counts"), [(0.6, False), (1.0, True)])
def test_a_brake_weaker_than_believed_limits_in_truth(force: float, counts: bool) -> None:
    """On a rail of 0.08 the full brake, 0.0952, would slide; worn pads give 0.6 of it."""
    slows = CONFIG.train.deceleration(0.08, force * CONFIG.brake(FULL_PA), CONFIG.train.specific_resistance(60.0))
    speeds = (300.0, *(260.0 - 3.6 * slows * second for second in range(5)))
    truth = truth_of(*((0.08, speed, FULL_PA) for speed in speeds))
    assert (mean_relative_error_percent(CONFIG, truth, [at(3, 0.1)]) is not None) is counts


def test_a_second_braking_does_not_start_the_30_kmh_anew() -> None:
    twice = truth_of((0.08, 300, FULL_PA), (0.08, 265, 0.0), (0.08, 265, FULL_PA), (0.08, 260, FULL_PA))
    assert mean_relative_error_percent(CONFIG, twice, [at(3, 0.1)]) == pytest.approx(25.0)


def test_a_touch_of_pressure_below_the_threshold_is_no_braking() -> None:
    touched = truth_of((0.08, 320, 5e3), (0.08, 300, FULL_PA), (0.08, 280, FULL_PA), (0.08, 260, FULL_PA))
    assert mean_relative_error_percent(CONFIG, touched, [at(2, 0.1)]) is None
    assert mean_relative_error_percent(CONFIG, touched, [at(3, 0.1)]) == pytest.approx(25.0)


def test_without_truth_or_estimates_there_is_no_score() -> None:
    assert mean_relative_error_percent(CONFIG, Truth(), [at(3, 0.1)]) is None
    assert mean_relative_error_percent(CONFIG, BRAKING, []) is None
    nameless = truth_of(*((0.08, 300 - 10 * second, FULL_PA) for second in range(10)))
    nameless.mu.clear()
    assert mean_relative_error_percent(CONFIG, nameless, [at(9, 0.1)]) is None


SLIDING = real_truth(
    (0.05, 80, False),
    (0.05, 80, True),
    (0.04, 60, True),  # a quarter is lost
    (0.04, 59, True),
    (0.05, 50, True),
    (0.05, 48, False),
    (0.05, 10, True),
)


def between(second: float, mu: float) -> Estimate:
    return at(0, mu)._replace(t_ns=round(second * S))


def test_a_real_train_counts_while_it_slides_whatever_the_stamps() -> None:
    assert mean_relative_error_percent(CONFIG, SLIDING, [between(2.9, 0.05)]) == pytest.approx(25.0)
    assert mean_relative_error_percent(CONFIG, SLIDING, [between(3.5, 0.045)]) == pytest.approx(0.0)
    for second in (0.5, 1.5, 4.1, 5.5, 7.0, 99.0):  # not limited, too early, about to end, after the end
        assert mean_relative_error_percent(CONFIG, SLIDING, [between(second, 0.05)]) is None
    both = [between(2.9, 0.05), between(5.5, 0.9)]
    assert mean_relative_error_percent(CONFIG, SLIDING, both) == pytest.approx(25.0)


def test_a_real_train_of_which_nothing_else_is_known_has_no_error() -> None:
    assert mean_relative_error_percent(CONFIG, Truth(limited={S: True}), [at(1, 0.1)]) is None
    assert mean_relative_error_percent(CONFIG, SLIDING, []) is None

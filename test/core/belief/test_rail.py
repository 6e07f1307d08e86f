# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is known of the rail: ageing, learning, and the share of the start, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adhesion_node.core.belief.rail import (
    Identification,
    Rail,
    age,
    ignorance,
    kept_of_start,
    learn,
    learn_bound,
    lower_bound,
)

NOTHING = ignorance(0.05, 0.04)


def test_ignorance_promises_no_more_than_the_low_law() -> None:
    assert Rail(0.05, 0.04, 0.05) == NOTHING


def test_age_by_hand() -> None:
    # after ln 4 memories a quarter is left: mu = 0.05 + 0.04/4; std^2 = 0.01^2/16 + 15/16 0.04^2; lower 0.05 + 0.03/4
    aged = age(Rail(0.09, 0.01, 0.08), NOTHING, math.log(4.0))
    assert aged == pytest.approx((0.06, math.sqrt(1e-4 / 16 + 15 / 16 * 1.6e-3), 0.0575))


def test_ageing_in_parts_is_ageing_at_once() -> None:
    known = Rail(0.09, 0.003, 0.085)
    parts = known
    for elapsed in (0.1, 0.0, 0.4, 0.5):
        parts = age(parts, NOTHING, elapsed)
    assert parts == pytest.approx(age(known, NOTHING, 1.0))


def test_ageing_ends_in_ignorance_and_starts_with_what_is_known() -> None:
    known = Rail(0.09, 0.003, 0.085)
    assert age(known, NOTHING, 0.0) == pytest.approx(known)
    assert age(known, NOTHING, 1e3) == pytest.approx(NOTHING)
    stds = [age(known, NOTHING, e).std for e in (0.0, 0.1, 0.5, 2.0)]
    assert stds == sorted(stds)


def test_share_of_the_start_by_hand() -> None:
    assert kept_of_start(1.0, 4.0, 3) == pytest.approx(0.421875)  # (3/4)^3
    assert kept_of_start(0.0, 4.0, 50) == 1.0  # nothing observed: all start
    assert kept_of_start(4.0, 4.0, 1) == 0.0  # nothing missing: one step is enough
    assert kept_of_start(5.0, 4.0, 1) == 0.0
    assert kept_of_start(0.0, 0.0, 1) == 1.0  # no step showed anything


def test_learning_from_a_window_that_kept_nothing_of_its_start() -> None:
    learnt = learn(NOTHING, Identification(0.08, 0.004, start=0.0, kept=0.0), 1.5)
    assert learnt.mu == 0.08
    assert learnt.std == pytest.approx(0.004)
    assert learnt.lower == pytest.approx(0.074)  # 0.08 - 1.5 x 0.004


def test_learning_nothing_changes_nothing() -> None:
    for std in (0.3, math.inf):
        assert learn(NOTHING, Identification(0.0, std, start=0.0, kept=1.0), 1.645) == NOTHING


def test_a_bound_is_never_negative() -> None:
    assert learn(NOTHING, Identification(0.01, 0.05, start=0.3, kept=0.0), 1.645).lower == 0.0


def test_a_limited_brake_only_raises() -> None:
    known = Rail(0.12, 0.01, 0.10)
    assert learn_bound(known, Rail(0.0952, 0.004, 0.088)) == known
    assert learn_bound(NOTHING, Rail(0.0952, 0.02, 0.088)) == Rail(0.0952, 0.04, 0.088)


@pytest.mark.parametrize("start_mu", [0.0, 0.03, 0.12])
def test_the_bound_stays_below_the_adhesion_however_em_was_started(start_mu: float) -> None:
    """A short window repeats its start (kept 0.98): what is published must still agree with itself."""
    learnt = learn(NOTHING, Identification(start_mu, 0.04, start_mu, 0.98), 1.645)
    assert learnt.lower <= learnt.mu


def test_what_em_kept_of_its_start_is_replaced_by_what_was_known() -> None:
    # EM went from 0 to 0.04 where 0.75 of the start is left: 0.04 + 0.75 (0.05 - 0); std 0.25 x 0.02 + 0.75 x 0.04;
    # lower 0.75 x 0.05 + 0.25 (0.0775 - 1.5 x 0.02)
    learnt = learn(NOTHING, Identification(0.04, 0.02, start=0.0, kept=0.75), 1.5)
    assert learnt == pytest.approx((0.0775, 0.035, 0.049375))
    # hence the start does not matter: EM from 0.12 arrives 0.75 x 0.12 higher
    assert learn(NOTHING, Identification(0.13, 0.02, start=0.12, kept=0.75), 1.5) == pytest.approx(learnt)


@pytest.mark.parametrize("known", [NOTHING, Rail(0.08, 0.03, 0.06)])
@pytest.mark.parametrize(("mu", "std"), [(0.05, 0.039), (0.03, 0.02), (0.09, 0.01), (0.055, 0.002)])
def test_a_known_bound_is_prior_knowledge(known: Rail, mu: float, std: float) -> None:
    """By sums over a grid: the prior is scaled below the bound to 5 %, above it to 95 %."""
    grid = np.linspace(-0.4, 0.6, 1_000_001)
    gaussian, posterior = (np.exp(-0.5 * ((grid - m) / s) ** 2) for m, s in ((known.mu, known.std), (mu, std)))
    below, likelihood = grid < known.lower, posterior / gaussian
    prior = np.where(below, 0.05 * gaussian / gaussian[below].sum(), 0.95 * gaussian / gaussian[~below].sum())
    share = np.cumsum(prior * likelihood) / np.sum(prior * likelihood)
    expected = grid[np.searchsorted(share, 0.05)]
    assert float(lower_bound(np.array(mu), np.array(std), known, 0.95)) == pytest.approx(expected, abs=2e-6)


def test_a_bound_that_says_less_than_its_law_supports_nothing() -> None:
    mu, std = np.array([0.05, 0.08]), np.array([0.02, 0.01])
    assert lower_bound(mu, std, Rail(0.08, 0.01, 0.06), 0.95) == pytest.approx(lower_bound(mu, std, None, 0.95))
    assert lower_bound(mu, std, None, 0.95) == pytest.approx(mu - 1.6448536269514722 * std)

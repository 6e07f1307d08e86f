# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is known of the rail: an adhesion, its standard deviation and a lower bound, learnt and forgotten.

While nothing can be seen, the knowledge ages exponentially with time and distance towards the configured
low-adhesion law; its standard deviation grows towards that of ignorance.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from ..physics.train import Array

BRAKES_SIGMA = 2.0
"""Standard deviations above 0 from which adhesion brakes the train."""


class Rail(NamedTuple):
    """Adhesion coefficient, its standard deviation and its one-sided lower bound."""

    mu: float
    std: float
    lower: float

    @property
    def brakes(self) -> bool:
        """Whether it brakes the train for certain; where no pressure is measured nothing else tells that it does."""
        return self.mu > BRAKES_SIGMA * self.std


def ignorance(low: float, std: float, lowest: float = math.inf) -> Rail:
    """Nothing is known: the low-adhesion law's value `low` with standard deviation `std`, but at least `lowest`."""
    return Rail(low, std, min(low, lowest))


def age(rail: Rail, nothing: Rail, elapsed: float) -> Rail:
    """Let knowledge age towards `nothing`; `elapsed` counts in memories (time and distance over their scales).

    >>> age(Rail(0.10, 0.0, 0.09), ignorance(0.05, 0.04), math.log(2.0))
    Rail(mu=0.07500000000000001, std=0.034641016151377546, lower=0.07)
    """
    kept = math.exp(-elapsed)
    return Rail(
        mu=nothing.mu + kept * (rail.mu - nothing.mu),
        std=math.sqrt(kept**2 * rail.std**2 + (1.0 - kept**2) * nothing.std**2),
        lower=nothing.lower + kept * (rail.lower - nothing.lower),
    )


def kept_of_start(observed: float, complete: float, iterations: int) -> float:
    """Share of its start that EM still holds after `iterations`.

    EM converges linearly at the rate of missing information, 1 - observed/complete (Dempster, Laird and Rubin
    1977), so a short window whose EM is stopped early mostly repeats what it was started with.

    >>> round(kept_of_start(observed=0.1, complete=1.0, iterations=10), 4)
    0.3487
    """
    if complete <= 0.0:
        return 1.0
    return min(max(1.0 - observed / complete, 0.0), 1.0) ** iterations


class Identification(NamedTuple):
    """What EM found in a window."""

    mu: float
    std: float
    """Standard deviation from the window alone."""
    start: float
    """Where EM started."""
    kept: float
    """Share of the start that is still in `mu`."""


def learn(before: Rail, identification: Identification, quantile: float) -> Rail:
    """Knowledge after a window: what EM kept of its start is replaced by what was known before.

    The errors of overlapping windows go together, so the standard deviations add up linearly. `quantile` is that of
    the lower bound's confidence.
    """
    kept = identification.kept
    if kept >= 1.0:  # nothing learnt; the window's standard deviation may be infinite
        return before
    mu = max(identification.mu + kept * (before.mu - identification.start), 0.0)
    lower = kept * before.lower + (1.0 - kept) * (mu - quantile * identification.std)
    return Rail(mu, (1.0 - kept) * identification.std + kept * before.std, min(max(lower, 0.0), mu))


def lower_bound(mu: Array, std: Array, known: Rail | None, confidence: float) -> Array:
    """Bound of adhesions with these Gaussian laws, element by element, which a bound known before may support.

    `known` says that mu is above its bound at that confidence, which is more than its own Gaussian law says. So its
    law is taken down below the bound until it says the same, and the posterior law with it.

    >>> nothing = ignorance(0.05, 0.04)
    >>> for mu, std in ((0.05, 0.04), (0.06, 0.02), (0.04, 0.02), (0.08, 0.002)):
    ...     print(lower_bound(np.array(mu), np.array(std), None, 0.95).round(4),
    ...           lower_bound(np.array(mu), np.array(std), nothing, 0.95).round(4))
    -0.0158 0.05
    0.0271 0.0511
    0.0071 0.0311
    0.0767 0.0767
    """
    missed = 1.0 - confidence
    if known is None:
        return np.asarray(mu + ndtri(missed) * std)
    before, below = ndtr((known.lower - known.mu) / known.std), ndtr((known.lower - mu) / std)
    weight = min(missed / confidence * (1.0 - before) / max(before, 1e-12), 1.0)
    tail = missed * (weight * below + 1.0 - below)
    tail = np.where(tail <= weight * below, tail / weight, tail + (1.0 - weight) * below)
    return np.asarray(mu + ndtri(tail) * std)


def learn_bound(before: Rail, bound: Rail) -> Rail:
    """Knowledge after a window that only showed mu to be at least `bound`: the better of both."""
    return Rail(max(before.mu, bound.mu), max(before.std, bound.std), max(before.lower, bound.lower))

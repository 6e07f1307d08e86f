# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One rail or another, as what is known of it has a probability: mean, scatter and bound of both laws together."""

import math

from scipy.special import ndtr, ndtri

from .rail import Rail

MISSED, LEAST_MU, LEAST_STD, BISECTIONS = 0.05, 1e-3, 1e-3, 40
"""What a bound misses; numbers that keep logarithms finite; steps to the bound."""


def either(seen: Rail, otherwise: Rail, probability: float) -> Rail:
    """The one rail with a probability, else the other; each law is that of its mean and its bound of 95 %.

    >>> nothing = Rail(0.06, 0.04, 0.02)
    >>> [round(either(Rail(0.10, 0.005, 0.09), nothing, p).lower, 4) for p in (0.0, 0.5, 0.9, 1.0)]
    [0.02, 0.0255, 0.06, 0.09]
    """
    mean = otherwise.mu + probability * (seen.mu - otherwise.mu)
    each = ((probability, seen), (1.0 - probability, otherwise))
    variance = sum(share * (rail.std**2 + (rail.mu - mean) ** 2) for share, rail in each)
    low, high = sorted(max(rail.lower, LEAST_MU) for _, rail in each)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = sum(share * _share_below(rail, middle) for share, rail in each)
        low, high = (middle, high) if below < MISSED else (low, middle)
    return Rail(mean, math.sqrt(variance), min(low, mean))


def _share_below(rail: Rail, mu: float) -> float:
    """Probability that a rail gives less, its logarithm being Gaussian."""
    lower = max(rail.lower, LEAST_MU)
    std = max(math.log(max(rail.mu, lower) / lower) / -float(ndtri(MISSED)), LEAST_STD)
    return float(ndtr(math.log(mu / max(rail.mu, lower)) / std))

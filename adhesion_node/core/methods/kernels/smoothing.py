# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Marginal particle smoother in a window of K steps with N particles.

Its loops run over plain rows of numbers, so that the compiler takes many of them at once, in single precision: a
pairwise weight to 1e-4, their sums to 1e-5, far below what N particles leave open. No row is summed up along itself,
as the order of that would depend on the processor: the weights of all pairs are formed twice instead, once for the
sums over the ancestors, once for the shares.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

if TYPE_CHECKING:
    from .filtering import Particles

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Bounds = NDArray[np.uint64]
"""Never negative, so that no index has to be asked whether it counts from the end."""

MANY, BUCKETS = 64, 64
"""Particles from which on those too far away are left out, and parts into which their range is cut for that."""

AT_ONCE = 16
"""Singles that the widest processors take at once."""

REACH = 8.0
"""Standard deviations of the process noise beyond which a particle counts as too far away to be an ancestor."""

LEFT_OUT = 1e-7
"""Part of a sum that may be left out at most."""

NEGLIGIBLE = 1e-10
"""Smoothed weight below which a particle is no part of any sum."""

BITS, UNIT = 1.0 / math.log(2.0), math.sqrt(0.5 / math.log(2.0))
"""A natural logarithm to the base 2; a standard deviation, so that exp(-x^2/2) is 2^-x^2."""

LEAST_BITS, WHOLE, ONE = np.float32(-80.0), np.float32(12582912.0), np.float32(1.0)
"""Least power of 2 that is told apart; what moves the whole part of a single into its last bits."""

C1, C2, C3, C4, C5, C6 = (np.float32(math.log(2.0) ** n / math.factorial(n)) for n in range(1, 7))
"""Taylor's series of 2^x."""


class Near(NamedTuple):
    """Of each particle: the first one near it on the other side of the step, and the first one behind those.

    Both are multiples of `AT_ONCE`, so the rows of particles are as long.
    """

    first: Bounds
    last: Bounds


@kernel
def _power(x: np.float32) -> np.float32:
    """2^x for -126 < x < 127, to 3e-7: the whole part by the bits of a number, the rest by Taylor's series."""
    moved = x + WHOLE
    r = x - (moved - WHOLE)
    series = ONE + r * (C1 + r * (C2 + r * (C3 + r * (C4 + r * (C5 + r * C6)))))
    bits = np.float32(series).view(np.int32) + (np.float32(moved).view(np.int32) << 23)
    return np.int32(bits).view(np.float32)


@kernel
def _alone(places: Array, logs: Array, after: Array, weight: float, now: Array) -> None:
    """Share the weight of a particle that no other explains well, counted from its likeliest ancestor."""
    likely = logs - 0.5 * ((places[0] - after[0]) ** 2 + (places[1] - after[1]) ** 2)
    likely = np.exp(likely - likely.max())
    now += weight / likely.sum() * likely


@kernel
def _direction(s: Array, v: Array) -> tuple[float, float]:
    """In which particles lie farthest apart: its cosine and sine."""
    mean_s, mean_v, ss, sv, vv = s.mean(), v.mean(), 0.0, 0.0, 0.0
    for i in range(s.size):
        ss += (s[i] - mean_s) ** 2
        sv += (s[i] - mean_s) * (v[i] - mean_v)
        vv += (v[i] - mean_v) ** 2
    angle = 0.5 * math.atan2(2.0 * sv, ss - vv)
    return math.cos(angle), math.sin(angle)


@kernel
def _padded(count: int) -> int:
    return (count + AT_ONCE - 1) // AT_ONCE * AT_ONCE


@kernel
def _ordered(along: Array, least: float, per: float, ends: Indices) -> tuple[Indices, Indices]:
    """Particles in the order of the buckets they fall into, and those buckets; `ends` tells where each one ends."""
    order, buckets = np.empty(along.size, dtype=np.int64), np.empty(along.size, dtype=np.int64)
    ends[:] = 0
    for i in range(along.size):
        buckets[i] = int(min(max((along[i] - least) * per, 0.0), BUCKETS - 1.0))
        ends[buckets[i]] += 1
    for bucket in range(1, BUCKETS):
        ends[bucket] += ends[bucket - 1]
    for i in range(along.size - 1, -1, -1):
        ends[buckets[i]] -= 1
        order[ends[buckets[i]]] = i
    for bucket in range(BUCKETS - 1):
        ends[bucket] = ends[bucket + 1]
    ends[BUCKETS - 1] = along.size
    return order, buckets[order]


@kernel
def _near(buckets: Indices, reach: int, ends: Indices) -> Near:
    """Who on the other side, where the buckets end so, is within reach."""
    first, last = np.empty(buckets.size, dtype=np.uint64), np.empty(buckets.size, dtype=np.uint64)
    for i in range(buckets.size):
        before = buckets[i] - reach - 1
        first[i] = (ends[before] if before >= 0 else 0) // AT_ONCE * AT_ONCE
        last[i] = _padded(ends[min(buckets[i] + reach, BUCKETS - 1)])
    return Near(first, last)


@kernel
def _sorted(here: Array, there: Array, alive: Indices) -> tuple[Indices, Indices, Near, Near]:
    """Both sides of a step in order along the widest spread, and who is near whom."""
    cos, sin = _direction(here[0], here[1])
    before, after = cos * here[0] + sin * here[1], cos * there[0][alive] + sin * there[1][alive]
    least, per = before.min(), BUCKETS / max(before.max() - before.min(), 1e-100)
    ends, others = np.empty(BUCKETS, dtype=np.int64), np.empty(BUCKETS, dtype=np.int64)
    order, buckets = _ordered(before, least, per, ends)
    following, their_buckets = _ordered(after, least, per, others)
    reach = int(min(REACH * per + 1.0, BUCKETS - 1.0))
    return order, alive[following], _near(buckets, reach, others), _near(their_buckets, reach, ends)


@kernel
def _lonely(places: Array, logs: Array, after: Array, weights: Array, which: Indices, now: Array) -> float:
    """Share those of the particles after a step that no other explains well; the sum of their weights."""
    total = 0.0
    for j in which:
        _alone(places, logs, after[:, j], weights[j], now)
        total += weights[j]
    return total


@kernel
def _scaled(places: Array, k: int, origin: tuple[float, float], per: tuple[float, float]) -> Array:
    """Places of one time in standard deviations of the process noise, (2, N)."""
    found = np.empty((2, places.shape[2]))
    for c in range(2):
        for i in range(found.shape[1]):
            found[c, i] = (places[c, k, i] - origin[c]) * per[c]
    return found


@kernel
def smoothed(particles: Particles, spread: Array) -> Array:
    """Smoothed weights w_t|S of the particles, (K + 1, N); `spread` of the process noise, (2, K).

    With the backward kernels p(x_t = i | x_t+1 = j, y) they are the sums over j of the pairwise weights (27): those
    after a step are shared among their ancestors, save where the ancestors' weights sum up to too little. The loops
    over pairs stand here, as calls at every step would take a fair part of the time of few particles.
    """
    states, stepped, logs = particles
    steps, count = stepped.shape[1], logs.shape[1]
    padded, many, marginal = _padded(count), count >= MANY, np.empty((steps + 1, count))
    memory = np.zeros((7, padded), dtype=np.float32)
    s, v, bits, after_s, after_v = memory[0], memory[1], memory[2], memory[3], memory[4]
    totals, now, alive, nobody = memory[5], memory[6], np.empty(count, np.int64), np.uint64(0)
    order, kept, none = alive, alive, np.empty(0, np.uint64)
    ahead_first, ahead_last, behind_first, behind_last = none, none, none, none
    least = count / LEFT_OUT * (math.exp(-0.5 * REACH**2) if many else 2.0**LEAST_BITS)
    marginal[steps] = np.exp(logs[steps])
    marginal[steps] /= marginal[steps].sum()
    for k in range(steps - 1, -1, -1):
        rows = 0
        for j in range(count):
            alive[rows] = j
            rows += int(marginal[k + 1, j] > NEGLIGIBLE)
        origin, per = (stepped[0, k, 0], stepped[1, k, 0]), (1.0 / spread[0, k], 1.0 / spread[1, k])
        if many:
            here, there = _scaled(stepped, k, origin, per), _scaled(states, k + 1, origin, per)
            order, kept, ahead, behind = _sorted(here, there, alive[:rows])
            (ahead_first, ahead_last), (behind_first, behind_last) = ahead, behind
        for i in range(count):
            at = order[i] if many else i
            s[i] = (stepped[0, k, at] - origin[0]) * per[0] * UNIT
            v[i] = (stepped[1, k, at] - origin[1]) * per[1] * UNIT
            bits[i] = logs[k, at] * BITS
        for j in range(rows):
            after_s[j] = (states[0, k + 1, kept[j]] - origin[0]) * per[0] * UNIT
            after_v[j] = (states[1, k + 1, kept[j]] - origin[1]) * per[1] * UNIT
        totals[:] = 0.0
        every = np.uint64(_padded(rows))
        for i in range(count):
            first, last = (ahead_first[i], ahead_last[i]) if many else (nobody, every)
            s_i, v_i, bits_i = s[i], v[i], bits[i]
            for j in range(first, last):
                off_s, off_v = after_s[j] - s_i, after_v[j] - v_i
                totals[j] += _power(max(bits_i - off_s * off_s - off_v * off_v, LEAST_BITS))
        now[:] = 0.0
        every, lonely = np.uint64(padded), 0
        for j in range(rows):
            lonely += int(totals[j] < least)
            share = np.float32(marginal[k + 1, kept[j]]) / totals[j] if totals[j] >= least else np.float32(0.0)
            s_j, v_j = after_s[j], after_v[j]
            first, last = (behind_first[j], behind_last[j]) if many else (nobody, every)
            for i in range(first, last):
                off_s, off_v = s[i] - s_j, v[i] - v_j
                now[i] += share * _power(max(bits[i] - off_s * off_s - off_v * off_v, LEAST_BITS))
        total = 0.0
        for i in range(count):
            at = order[i] if many else i
            marginal[k, at] = now[i]
            total += marginal[k, at]
        if lonely:
            here, there = _scaled(stepped, k, origin, per), _scaled(states, k + 1, origin, per)
            total += _lonely(here, logs[k], there, marginal[k + 1], kept[:rows][totals[:rows] < least], marginal[k])
        for i in range(count):
            marginal[k, i] /= total
    return marginal

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
Singles = NDArray[np.float32]
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


class Cloud(NamedTuple):
    """Particles of one time: places, in `UNIT` from one of them, and weights, or their logarithms to the base 2."""

    s: Singles
    v: Singles
    weight: Singles


class Near(NamedTuple):
    """Of each particle: the first one near it on the other side of the step, and the first one behind those.

    Both are multiples of `AT_ONCE`, so the clouds are as long.
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
def _summed(before: Cloud, after: Cloud, near: Near, totals: Singles) -> None:
    """Sum up w_t^i p(x_t+1^j | x_t^i) over the ancestors of each particle after a step, up to a constant."""
    totals[:] = 0.0
    for i in range(near.first.size):
        s, v, weight = before.s[i], before.v[i], before.weight[i]
        for j in range(near.first[i], near.last[i]):
            off_s, off_v = after.s[j] - s, after.v[j] - v
            totals[j] += _power(max(weight - off_s * off_s - off_v * off_v, LEAST_BITS))


@kernel
def _shared(before: Cloud, after: Cloud, rows: int, near: Near, totals: Singles, least: float, now: Singles) -> None:
    """Share the smoothed weights after a step among the ancestors (27), save where these sum up to less than that."""
    now[:] = 0.0
    for j in range(rows):
        if totals[j] >= least:
            s, v, share = after.s[j], after.v[j], after.weight[j] / totals[j]
            for i in range(near.first[j], near.last[j]):
                off_s, off_v = before.s[i] - s, before.v[i] - v
                now[i] += share * _power(max(before.weight[i] - off_s * off_s - off_v * off_v, LEAST_BITS))


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
def _fill(cloud: Cloud, places: Array, weights: Array, k: int, unit: float, which: Indices, count: int) -> None:
    """Take so many particles, in that order, as singles."""
    for i in range(count):
        cloud.s[i], cloud.v[i] = places[0, which[i]] * UNIT, places[1, which[i]] * UNIT
        cloud.weight[i] = weights[k, which[i]] * unit


@kernel
def smoothed(particles: Particles, spread: Array) -> Array:
    """Smoothed weights w_t|S of the particles, (K + 1, N); `spread` of the process noise, (2, K).

    With the backward kernels p(x_t = i | x_t+1 = j, y) they are the sums over j of the pairwise weights (27).
    """
    states, stepped, logs = particles
    steps, count = stepped.shape[1], logs.shape[1]
    marginal, here, there = np.empty((steps + 1, count)), np.empty((2, count)), np.empty((2, count))
    memory = np.zeros((8, _padded(count)), dtype=np.float32)
    before, after = Cloud(memory[0], memory[1], memory[2]), Cloud(memory[3], memory[4], memory[5])
    totals, now, alive = memory[6], memory[7], np.empty(count, dtype=np.int64)
    everyone, whole = np.arange(count), Near(np.zeros(count, np.uint64), np.full(count, now.size, np.uint64))
    least = count / LEFT_OUT * (math.exp(-0.5 * REACH**2) if count >= MANY else 2.0**LEAST_BITS)
    marginal[steps] = np.exp(logs[steps])
    marginal[steps] /= marginal[steps].sum()
    for k in range(steps - 1, -1, -1):
        rows = 0
        for i in range(count):
            alive[rows] = i
            rows += int(marginal[k + 1, i] > NEGLIGIBLE)
        for c in range(2):  # in standard deviations of the process noise, from one of them
            origin, per = stepped[c, k, 0], 1.0 / spread[c, k]
            for i in range(count):
                here[c, i] = (stepped[c, k, i] - origin) * per
                there[c, i] = (states[c, k + 1, i] - origin) * per
        order, kept, ahead, behind = everyone, alive, whole, whole
        if count >= MANY:
            order, kept, ahead, behind = _sorted(here, there, alive[:rows])
        _fill(before, here, logs, k, BITS, order, count)
        _fill(after, there, marginal, k + 1, 1.0, kept, rows)
        _summed(before, after, ahead, totals)
        _shared(before, after, rows, behind, totals, least, now)
        total = 0.0
        for i in range(count):
            marginal[k, order[i]] = now[i]
            total += marginal[k, order[i]]
        for j in range(rows):
            if totals[j] < least:
                _alone(here, logs[k], there[:, kept[j]], marginal[k + 1, kept[j]], marginal[k])
                total += marginal[k + 1, kept[j]]
        for i in range(count):
            marginal[k, i] /= total
    return marginal

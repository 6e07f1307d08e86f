# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Marginal particle smoother in a window of K steps with N particles.

Its loops run over plain blocks of numbers, so that the compiler takes several of them at once.
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

MANY, BUCKETS = 64, 64
"""Particles from which on those too far away are left out, and parts into which their range is cut for that."""

REACH = 9.5
"""Standard deviations of the process noise beyond which a particle counts as too far away to be an ancestor."""

LEFT_OUT, SMALLEST_TOTAL = 1e-12, 1e-100
"""Part of a sum that may be left out at most, and the least sum that has not lost digits."""

NEGLIGIBLE = 1e-18
"""Smoothed weight below which a particle is no part of any sum."""

AT_ONCE = 1024
"""Numbers of a block, which stays in the processor's cache."""

LEAST_EXPONENT = -300.0
"""Weights below exp of this are no part of any sum."""


class Cloud(NamedTuple):
    """Particles of one time, in standard deviations of the process noise, with weights or their logarithms."""

    s: Array
    v: Array
    weight: Array


class Ancestors(NamedTuple):
    """Of each particle after a step: the first ancestor, and the first one behind them."""

    first: Indices
    last: Indices
    least: float
    """What a row of exponentials must sum to; else it is formed anew of all particles, counted from the likeliest."""


class Memory(NamedTuple):
    """Where all steps write."""

    block: Array
    buffer: Array
    far: Indices


@kernel
def _exponential(x: Array, buffer: Array) -> None:
    """exp(x) in place, for -700 < x < 700, to 1e-14: 2^k by the bits of a number, the rest by Taylor's series."""
    bits = buffer.view(np.int64)
    for i in range(x.size):
        buffer[i] = x[i] * 1.4426950408889634 + 6755399441055744.0  # k stands in the last bits
    for i in range(x.size):
        k = buffer[i] - 6755399441055744.0
        r = x[i] - k * 6.93147180369123816490e-01 - k * 1.90821492927058770002e-10
        series = 1.0 / 3628800.0 + r * (1.0 / 39916800.0)
        series = 1.0 / 40320.0 + r * (1.0 / 362880.0 + r * series)
        series = 1.0 / 720.0 + r * (1.0 / 5040.0 + r * series)
        series = 1.0 / 24.0 + r * (1.0 / 120.0 + r * series)
        x[i] = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * series)))
    for i in range(x.size):
        bits[i] = (bits[i] + 1023) << 52
    for i in range(x.size):
        x[i] *= buffer[i]


@kernel
def _ordered(along: Array, order: Indices, ends: Indices) -> tuple[float, float]:
    """Order numbers by the bucket they fall into, and say where each bucket ends; return least and buckets per unit."""
    least, per = along.min(), (BUCKETS - 1e-6) / max(along.max() - along.min(), 1e-100)
    ends[:] = 0
    for i in range(along.size):
        ends[int((along[i] - least) * per)] += 1
    for bucket in range(1, BUCKETS):
        ends[bucket] += ends[bucket - 1]
    for i in range(along.size - 1, -1, -1):
        bucket = int((along[i] - least) * per)
        ends[bucket] -= 1
        order[ends[bucket]] = i
    for bucket in range(BUCKETS - 1):
        ends[bucket] = ends[bucket + 1]
    ends[BUCKETS - 1] = along.size
    return least, per


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
def _part(cloud: Cloud, first: int, last: int) -> Cloud:
    return Cloud(cloud.s[first:last], cloud.v[first:last], cloud.weight[first:last])


@kernel
def _exponents(block: Array, before: Cloud, after: Cloud) -> None:
    """ln w_t^i p(x_t+1^j | x_t^i) up to a constant, shape (J, I)."""
    for j in range(block.shape[0]):
        for i in range(block.shape[1]):
            off_s, off_v = before.s[i] - after.s[j], before.v[i] - after.v[j]
            block[j, i] = max(before.weight[i] - 0.5 * (off_s * off_s + off_v * off_v), LEAST_EXPONENT)


@kernel
def _alone(before: Cloud, after: Cloud, j: int, now: Array) -> None:
    """Share the weight of a particle that no other explains well, counted from its likeliest ancestor."""
    likely = before.weight - 0.5 * ((before.s - after.s[j]) ** 2 + (before.v - after.v[j]) ** 2)
    likely = np.exp(likely - likely.max())
    now += after.weight[j] / likely.sum() * likely


@kernel
def _shared(block: Array, after: Cloud, least: float, now: Array, far: Indices) -> int:
    """Share the smoothed weights after a step among ancestors (27); note whose row sums to less than `least`."""
    found = 0
    for j in range(block.shape[0]):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        whole = block.shape[1] // 4
        for i in range(whole):
            a += block[j, 4 * i]
            b += block[j, 4 * i + 1]
            c += block[j, 4 * i + 2]
            d += block[j, 4 * i + 3]
        for i in range(4 * whole, block.shape[1]):
            a += block[j, i]
        total = (a + b) + (c + d)
        if total < least:
            far[found] = j
            found += 1
        else:
            share = after.weight[j] / total
            for i in range(block.shape[1]):
                now[i] += share * block[j, i]
    return found


@kernel
def _taken(cloud: Cloud, which: Indices) -> Cloud:
    return Cloud(cloud.s[which], cloud.v[which], cloud.weight[which])


@kernel
def _near(before: Cloud, after: Cloud, ends: Indices) -> tuple[Cloud, Cloud, Indices, Ancestors]:
    """Both clouds in order along the widest spread, the first one's order, and who may be an ancestor of each."""
    (cos, sin), count = _direction(before.s, before.v), after.s.size
    order, others = np.empty(before.s.size, dtype=np.int64), np.empty(count, dtype=np.int64)
    along = cos * after.s + sin * after.v
    _ordered(along, others, ends)
    least, per = _ordered(cos * before.s + sin * before.v, order, ends)
    first, last = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    for j in range(count):
        from_bucket = int(min(max((along[others[j]] - REACH - least) * per, 0.0), BUCKETS))
        to_bucket = int(min(max((along[others[j]] + REACH - least) * per, -1.0), BUCKETS - 1.0))
        first[j] = ends[from_bucket - 1] if from_bucket > 0 else 0
        last[j] = max(ends[to_bucket] if to_bucket >= 0 else 0, first[j])
    least_sum = before.s.size * math.exp(-0.5 * REACH**2) / LEFT_OUT
    return _taken(before, order), _taken(after, others), order, Ancestors(first, last, least_sum)


@kernel
def _share(before: Cloud, after: Cloud, ancestors: Ancestors, memory: Memory, now: Array) -> None:
    """Share the weights after a step, of each particle among its ancestors."""
    rows, done, (first, last, least) = after.s.size, 0, ancestors
    while done < rows:
        low, high, until = first[done], last[done], done + 1
        while until < rows:
            wider = max(high, last[until]) - min(low, first[until])
            if wider * (until + 1 - done) > AT_ONCE:
                break
            low, high, until = min(low, first[until]), max(high, last[until]), until + 1
        size = (until - done) * (high - low)
        part, these, block = _part(before, low, high), _part(after, done, until), memory.block[:size]
        _exponents(block.reshape(until - done, high - low), part, these)
        _exponential(block, memory.buffer[:size])
        found = _shared(block.reshape(until - done, high - low), these, least, now[low:high], memory.far)
        for one in range(found):
            _alone(before, these, memory.far[one], now)
        done = until


@kernel
def _filled(places: Array, weights: Array, least: float, scale: Array, cloud: Cloud) -> int:
    """Take the particles of more than the least weight; return their number."""
    found = 0
    for i in range(weights.size):
        if weights[i] > least:
            cloud.s[found], cloud.v[found] = places[0, i] * scale[0], places[1, i] * scale[1]
            cloud.weight[found] = weights[i]
            found += 1
    return found


@kernel
def smoothed(particles: Particles, spread: Array) -> Array:
    """Smoothed weights w_t|S of the particles, (K + 1, N); `spread` of the process noise, (2, K).

    With the backward kernels p(x_t = i | x_t+1 = j, y) they are the sums over j of the pairwise weights (27).
    """
    states, stepped, logs = particles
    steps, count = stepped.shape[1], logs.shape[1]
    marginal = np.zeros((steps + 1, count))
    size = max(AT_ONCE, count)
    memory = Memory(np.empty(size), np.empty(size), np.empty(count, dtype=np.int64))
    clouds = (
        Cloud(np.empty(count), np.empty(count), np.empty(count)),
        Cloud(np.empty(count), np.empty(count), np.empty(count)),
    )
    everyone = Ancestors(np.zeros(count, dtype=np.int64), np.full(count, count), SMALLEST_TOTAL)
    ends, scales = np.empty(BUCKETS, dtype=np.int64), np.ascontiguousarray((1.0 / spread).T)
    marginal[steps] = np.exp(logs[steps] - logs[steps].max())
    marginal[steps] /= marginal[steps].sum()
    for k in range(steps - 1, -1, -1):
        _filled(stepped[:, k], logs[k], -np.inf, scales[k], clouds[0])
        clouds[0].weight[:] -= logs[k].max()
        rows = _filled(states[:, k + 1], marginal[k + 1], NEGLIGIBLE, scales[k], clouds[1])
        after = _part(clouds[1], 0, rows)
        if count < MANY:
            _share(clouds[0], after, everyone, memory, marginal[k])
        else:
            before, after, order, ancestors = _near(clouds[0], after, ends)
            now = np.zeros(count)
            _share(before, after, ancestors, memory, now)
            marginal[k][order] = now
    return marginal

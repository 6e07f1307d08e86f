# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The search for a jump within a window: at each candidate as one more unknown of the normal equation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

if TYPE_CHECKING:
    from .equation import Solved

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

HALF, KEPT, EFFECT_S, EFFECT, ERROR_S, ERROR, HEADROOM = 0, 1, 2, 3, 4, 5, 6
PIVOT, NEAR, FAR, BORDER = 0, 1, 2, 4
"""As in `equation`."""
BY_S, BY_V, BY_LATER_S, BY_LATER_V, OWN, PULL, SHARED = 0, 1, 2, 3, 4, 5, 6
"""Columns of the parts: what a jump before or in a step adds there, to A's border of the states before and after it,
to the jump's own diagonal and gradient, and to what it shares with kappa."""


class Tried(NamedTuple):
    """Jumps at each of C candidates, shape (C,)."""

    sizes: Array
    """The most probable ones."""
    odds: Array
    """Logarithms of the odds against no jump."""
    information: Array
    """On the jump."""
    per_jump: Array
    """How far a jump moves (s, v, kappa) at the end through the states, shape (3, C)."""


@kernel
def of_kappa(now: Solved, sure: Array) -> Array:
    """Parts, shape (K, 7), of a jump of kappa; `sure` are the inverse variances of the process noise, shape (2, K)."""
    steps, parts = now.steps, np.zeros((now.steps.shape[0], 7))
    for k in range(steps.shape[0]):
        to_s, to_v = sure[0, k] * steps[k, EFFECT_S], sure[1, k] * steps[k, EFFECT]
        parts[k, BY_S], parts[k, BY_V] = to_s, steps[k, HALF] * to_s + steps[k, KEPT] * to_v
        parts[k, BY_LATER_S], parts[k, BY_LATER_V] = -to_s, -to_v
        parts[k, OWN] = to_s * steps[k, EFFECT_S] + to_v * steps[k, EFFECT]
        parts[k, PULL] = to_s * steps[k, ERROR_S] + to_v * steps[k, ERROR]
        parts[k, SHARED] = parts[k, OWN] if steps[k, HEADROOM] > 0.0 else 0.0
    return parts


@kernel
def of_positions(seen: Array, off: Array) -> Array:
    """Parts of a step of the positions, by their information and deviations, shape (K,)."""
    parts = np.zeros((seen.size, 7))
    for k in range(seen.size):
        parts[k, BY_LATER_S] = parts[k, OWN] = seen[k]
        parts[k, PULL] = seen[k] * off[k]
    return parts


@kernel
def _border(parts: Array, first: int) -> Array:
    """Of a jump from the step `first` on, shape (2K + 2,)."""
    border = np.zeros(2 * parts.shape[0] + 2)
    for k in range(first, parts.shape[0]):
        for i in range(4):
            border[2 * k + i] += parts[k, i]
    return border


@kernel
def tried(now: Solved, parts: Array, candidates: Indices, std: float, only_falls: bool) -> Tried:
    """Try a jump of standard deviation `std`, before, from each candidate on.

    With `only_falls` one that rises cannot be seen where the brake limits.
    """
    rows, count = now.rows, candidates.size
    size, near, far = now.moved.size, rows[NEAR], rows[FAR]
    found = Tried(np.empty(count), np.empty(count), np.empty(count), np.empty((3, count)))
    for c in range(count):
        first = candidates[c]
        half, still, with_kappa, explained = _border(parts, first), 0.0, 0.0, 0.0
        for i in range(2 * first, size):  # before it there is nothing
            still += half[i] * now.moved[i]
            if i > 0:
                half[i] -= near[i] * half[i - 1]
            if i > 1:
                half[i] -= far[i] * half[i - 2]
            explained += half[i] ** 2 * rows[PIVOT, i]
            with_kappa += half[i] * rows[BORDER, i] * rows[PIVOT, i]
        own, pull, shared = parts[first:, OWN].sum(), parts[first:, PULL].sum(), parts[first:, SHARED].sum()
        on_kappa = (shared - with_kappa) / now.information
        known = own + std**-2 - explained - now.information * on_kappa**2
        jump = (pull - still - shared * now.change) / known
        seen = jump < 0.0 or not only_falls or now.steps[first, HEADROOM] > 0.0
        found.sizes[c], found.information[c] = jump, known
        found.odds[c] = 0.5 * jump**2 * known - 0.5 * math.log(known * std**2) if seen else -np.inf
        last = (half[-1] - on_kappa * rows[BORDER, -1]) * rows[PIVOT, -1]
        before = (half[-2] - on_kappa * rows[BORDER, -2]) * rows[PIVOT, -2] - near[-1] * last
        found.per_jump[0, c], found.per_jump[1, c], found.per_jump[2, c] = -before, -last, -on_kappa
    return found


@kernel
def moved(now: Solved, parts: Array, first: int, size: float) -> Array:
    """Step of the trajectory where kappa or the positions jump by `size` from the step `first` on, shape (2K + 2,)."""
    rows, half = now.rows, _border(parts, first)
    with_kappa = 0.0
    for i in range(half.size):
        half[i] -= rows[NEAR, i] * half[i - 1] if i > 0 else 0.0
        half[i] -= rows[FAR, i] * half[i - 2] if i > 1 else 0.0
        with_kappa += half[i] * rows[BORDER, i] * rows[PIVOT, i]
    on_kappa = (parts[first:, SHARED].sum() - with_kappa) / now.information
    for i in range(half.size - 1, -1, -1):
        half[i] = (half[i] - on_kappa * rows[BORDER, i]) * rows[PIVOT, i]
        half[i] -= rows[NEAR, i + 1] * half[i + 1] if i + 1 < half.size else 0.0
        half[i] -= rows[FAR, i + 2] * half[i + 2] if i + 2 < half.size else 0.0
    return now.moved - size * half

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Positions that a wheel has rolled hardly scatter, as no satellites' do: so a short look tells that it slides."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...physics.train import Array
from .possible import Possible
from .wandering import FEW, Wandering

LEARNT_S, THREE = (1.1, 2.2), 3
"""Times over which the scatter is looked at, the first in which so many positions come."""

LEAST, SCATTER_M, LEAST_M = 8, 0.05, 0.01
"""Looks that it takes at least, and the scatter from which positions are no wheel's, in many: satellites' is 0.07 m at
least, but of such as are corrected to some centimetres, which a train may brake by as well; and what they err by at
least, as pulses come evenly at a steady speed."""

FAR = 3.0
"""Standard deviations, and twice `SCATTER_M`, that a look counts as at most: a step is no scatter."""

LOOKS_S, FEWEST, SIGMA = (3.3, 2.2, 1.5, 1.0, 0.7), 4, 5.0
"""Times over which it is looked whether it slides, how many positions that takes, as they may have stepped, and the
standard deviations beyond which no train moves so."""

SELDOM = 5
"""Positions that are fewer over the longest look do not tell a step from a slide: it is taken for one."""

CREEP, SHARP = 0.01, 1.875
"""Creep of a wheel that rolls under the brake. Where the speed changes at once, the parabola over a time T slows down
by so many times the change over T: it weighs the deceleration at the part u of that by 30 u^2 (1 - u)^2."""


class Rolling(NamedTuple):
    """By how much positions scatter."""

    differing: Wandering = Wandering()
    """How decelerations differ, as by white errors of such a variance, m^2."""

    def unseen(self) -> Rolling:
        """With a look that sees too few positions."""
        return Rolling(self.differing.unseen())

    def after(self, time: Array, places: Array, speed_mps: float) -> Rolling:
        """With a look at the newest positions, s and m; no brake has been applied since the first of them."""
        for span_s in LEARNT_S:
            first = int(time.searchsorted(-span_s))
            if time.size - first >= THREE:
                weights = _weights(time[first:])[:, 0]
                slowing, per_square = float(places[first:] @ weights), 1.0 / float(np.square(weights).sum())
                most_m2 = max(FAR**2 * self.differing.mean, (2.0 * SCATTER_M) ** 2)
                return Rolling(self.differing.after(slowing, per_square, speed_mps, most_m2))
        return self.unseen()

    @property
    def is_learnt(self) -> bool:
        """Whether that is known."""
        return self.differing.learnt >= LEAST

    @property
    def is_known(self) -> bool:
        """Whether the positions are a wheel's, as they scatter by so little; of few looks even less is asked."""
        return self.is_learnt and (1.0 + FEW / self.differing.learnt) ** 2 * self.differing.mean < SCATTER_M**2

    def slides(self, time: Array, places: Array, rounded_m: float, settled_s: float, possible: Possible) -> bool:
        """Whether no train moves so as the newest positions do, s and m, which may have stepped once.

        It had been braked for long at `settled_s`.
        """
        learnt_m2 = (1.0 + FEW / self.differing.learnt) * self.differing.mean
        error_m = SIGMA * math.sqrt(learnt_m2 + max(rounded_m, LEAST_M) ** 2)
        seldom = time.size - int(time.searchsorted(-LOOKS_S[0])) < SELDOM
        for span_s in LOOKS_S:
            first = int(time.searchsorted(-span_s))
            if time.size - first < (THREE if seldom else FEWEST):
                break
            weights = _weights(time[first:]) if seldom else _stepping(time[first:])
            slowing, per_metre = places[first:] @ weights, np.sqrt(np.square(weights).sum(axis=0))
            error = error_m * per_metre - SHARP * CREEP * possible.speed_mps / time[first]
            gains = time[first] >= settled_s and (slowing + error < possible.least_mps2).all()
            if gains or (slowing - error > possible.most_mps2).all():
                return True
        return False


def _stepping(time: Array) -> Array:
    """Weights of N positions in N - 1 decelerations, shape (N, N - 1): they stepped by any way behind one of them.

    Three of them must lie apart in time, as those do that are kept.
    """
    steps = np.tri(time.size, time.size - 1, -1)
    basis, _ = np.linalg.qr(np.vander(time, 3))
    off = steps - basis @ (basis.T @ steps)
    weights = _weights(time)
    return np.asarray(weights - off / np.square(off).sum(axis=0) * (weights.T @ steps))


def _weights(time: Array) -> Array:
    """Weights of N positions in the deceleration of the parabola through them, 1/s^2, shape (N, 1)."""
    return np.asarray(-2.0 * np.linalg.pinv(np.vander(time, 3))[:1].T)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How the fastest rim errs under the brake: a train's course is smooth; what wanders about it is the creep of axles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .axles import ROLLS

S = 1_000_000_000

SPAN_NS, SAMPLES = 12 * S, 16
"""Over which time a parabola is laid through its speeds, as a train brakes; through so many at least."""

FAR = 0.02
"""Farther from it, relative, none rolled but slid: that tells nothing of those that do."""

QUICK, LEAST = 2.0, 0.003
"""Times the variance of its quick error that is counted, as it never runs ahead of the train; and what there is at
least, relative."""

LASTING = 2.0
"""Variance over 1 s by which creep wanders, over the covariance of successive errors. Protection that holds all axles
at a few per cent of creep shows 1e-5, where axles recover there is hardly any."""

SWAY = 0.1
"""By how much of itself the creep of all rims alike wanders within 1 s, at least."""


class Errors(NamedTuple):
    """Of the fastest rim's speed, relative."""

    quick: float = ROLLS
    """Standard deviation of what does not last from one of its speeds to the next."""
    lasting: float = 0.0
    """Variance over 1 s of what does."""


class Rolled(NamedTuple):
    """What the radius of all was, beside the expected one, when axles began to slide in this braking."""

    radius: float
    variance: float
    """Of what does not go with the scale of the measured speeds."""
    by_scale: float = 0.0
    """By how much it goes with that: where speeds are read too high, rims seem to be slow."""
    scale: float = 0.0
    """What the scale was believed to be."""


class Wander(NamedTuple):
    """How fast the fastest rim was each time that it was taken for the train's speed."""

    taken: tuple[tuple[int, float], ...] = ()
    """Stamps, ns, and speeds."""
    rolled: Rolled | None = None

    def after(self, t_ns: int, rim_mps: float) -> Wander:
        """Note the next one."""
        return self._replace(taken=(*(each for each in self.taken if t_ns - each[0] <= SPAN_NS), (t_ns, rim_mps)))

    def errors(self, radius: float = 0.0) -> Errors:
        """What they show by now, while all rims are as if their radius were so.

        >>> steady = Wander(tuple((index * S // 2, 40.0 - 0.3 * index) for index in range(20)))
        >>> steady.errors().quick
        0.003
        """
        least = Errors(lasting=(SWAY * max(self.rolled.radius - radius, 0.0)) ** 2 if self.rolled else 0.0)
        if len(self.taken) < SAMPLES:
            return least
        stamps, speeds = np.array(self.taken).T
        powers = np.vander((stamps - stamps[0]) / SPAN_NS, 3)
        relative = speeds / speeds.mean()
        off = relative - powers @ np.linalg.lstsq(powers, relative, rcond=None)[0]
        if np.abs(off).max() > FAR:
            return least
        lasting = max(float(off[1:] @ off[:-1]) / (off.size - 1), 0.0)
        quick = QUICK * max(float(off @ off) / off.size - lasting, 0.0)
        return Errors(min(max(quick**0.5, LEAST), ROLLS), max(LASTING * lasting, least.lasting))

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How much a sensor's values scatter, whatever its messages tell: it counts where it is more."""

from __future__ import annotations

from typing import NamedTuple

S = 1_000_000_000

SPAN_NS, SAMPLES, LEAST = 5 * S // 2, 50, 20
"""Three of a sensor's values within such a time tell how they scatter, whatever the train does; of how many the mean is
taken, and of how many at least."""

FAR, SLOW_FAR = 4.0, 3.0
"""Standard deviations that one counts as at most; of means over a second less: a driver's hand is seen there, too."""

UNDERTOLD = 2.25
"""Times the variance that a message tells, from which the scatter counts instead."""


class Scatter(NamedTuple):
    """How the values of a sensor scatter about straight lines through their neighbours."""

    before: tuple[tuple[int, float], ...] = ()
    """Stamp, ns, and value of the last two."""
    variance: float = 0.0
    samples: int = 0
    far: float = FAR

    def after(self, t_ns: int, value: float, told: float, real: float = 0.0) -> Scatter:
        """Note the next value, whose message tells such a variance; so much of it is no error."""
        before = (*self.before[-1:], (t_ns, value))
        if len(self.before) < 2:
            return self._replace(before=before)
        (first_ns, first), (middle_ns, middle) = self.before
        if not first_ns < middle_ns < t_ns <= first_ns + SPAN_NS:
            return self._replace(before=before)
        share = (middle_ns - first_ns) / (t_ns - first_ns)
        off = middle - (1.0 - share) * first - share * value
        square = off**2 / (1.0 + (1.0 - share) ** 2 + share**2) - real
        samples = min(self.samples + 1, SAMPLES)
        square = min(square, self.far**2 * max(self.variance, told))
        return Scatter(before, self.variance + (square - self.variance) / samples, samples, self.far)

    @property
    def is_known(self) -> bool:
        """Whether enough was measured."""
        return self.samples >= LEAST

    def variance_of(self, told: float) -> float:
        """Variance of a value whose message tells such a one."""
        return self.variance if self.is_known and self.variance > UNDERTOLD * told else told


class Shaking(NamedTuple):
    """How an accelerometer is shaken: from step to step and, while no brake is applied, from second to second."""

    quick: Scatter = Scatter()
    slow: Scatter = Scatter(far=SLOW_FAR)
    since_ns: int = 0
    """Begin of the present second, ..."""
    felt: float = 0.0
    """... the integral of what was felt in it, m/s, ..."""
    felt_s: float = 0.0
    """... and over which time."""

    def after(self, t_ns: int, mean: float, told: float, elapsed_s: float, swing: float | None) -> Shaking:
        """Note the mean over a step, of such a variance; the brake makes what is felt `swing` by such a one."""
        quick = self.quick.after(t_ns, mean, told, swing or 0.0)
        if swing is not None:
            return self._replace(quick=quick, felt_s=0.0)
        if not self.felt_s or t_ns - self.since_ns > 2 * S:
            return self._replace(quick=quick, since_ns=t_ns, felt=mean * elapsed_s, felt_s=elapsed_s)
        felt, felt_s = self.felt + mean * elapsed_s, self.felt_s + elapsed_s
        if t_ns - self.since_ns < S:
            return self._replace(quick=quick, felt=felt, felt_s=felt_s)
        slow = self.slow.after(t_ns, felt / felt_s, told * elapsed_s / felt_s)
        return Shaking(quick, slow)

    def variance_of(self, told: float, elapsed_s: float) -> float:
        """Variance of the mean over a step whose messages tell such a one, as if its errors did not last."""
        slow = self.slow.variance_of(told * elapsed_s) / elapsed_s
        return max(self.quick.variance_of(told), slow)

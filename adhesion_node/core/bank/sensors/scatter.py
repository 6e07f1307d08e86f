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

SPAN_NS, SAMPLES = 5 * S // 2, 50
"""Three of a sensor's values within such a time tell how they scatter, whatever the train does; of how many the mean is
taken."""

SELDOM = 2.1
"""Means over a second lie a value's period farther apart than that: three of them are looked at within so many times
both, where that is longer."""

LEAST, SLOW_LEAST = 20, 5
"""Of how many values it is taken at least, and of how many means over a second."""

FAR, SLOW_FAR, BRAKED_FAR, PLACE_FAR = 4.0, 3.0, 1.5, 2.0
"""Standard deviations that one counts as at most; of means over a second less, as a driver's hand is seen there, too,
and under the brake least, as the adhesion's fall is; of positions less, as outliers are met among them."""

UNDERTOLD, FEW = 2.25, 4.0
"""Times the variance that a message tells, from which the scatter counts instead; of n values by FEW / n more."""

LASTING = 4.0
"""Times what means of a speed scatter from second to second, where that is more than is told: what lasts longer, as
behind a receiver's own filter, is seen there in part."""


class Scatter(NamedTuple):
    """How the values of a sensor scatter about straight lines through their neighbours."""

    before: tuple[tuple[int, float], ...] = ()
    """Stamp, ns, and value of the last two."""
    variance: float = 0.0
    samples: int = 0
    least: int = LEAST

    def after(
        self, t_ns: int, value: float, told: float, real: float = 0.0, far: float = FAR, span_ns: int = SPAN_NS
    ) -> Scatter:
        """Note the next value, whose message tells such a variance; so much of it is no error."""
        before = (*self.before[-1:], (t_ns, value))
        if len(self.before) < 2:
            return self._replace(before=before)
        (first_ns, first), (middle_ns, middle) = self.before
        if not first_ns < middle_ns < t_ns <= first_ns + span_ns:
            return self._replace(before=before)
        share = (middle_ns - first_ns) / (t_ns - first_ns)
        off = middle - (1.0 - share) * first - share * value
        square = off**2 / (1.0 + (1.0 - share) ** 2 + share**2) - real
        samples = min(self.samples + 1, SAMPLES)
        square = min(square, far**2 * max(self.variance, told))
        return Scatter(before, self.variance + (square - self.variance) / samples, samples, self.least)

    def since_s(self, t_ns: int) -> float:
        """Time since the value before, of 10 ms at least; 1 s, if that is longer, or there is none."""
        return min(max(t_ns - self.before[-1][0], S // 100) / S, 1.0) if self.before else 1.0

    @property
    def is_known(self) -> bool:
        """Whether enough was measured."""
        return self.samples >= self.least

    def variance_of(self, told: float) -> float:
        """Variance of a value whose message tells such a one."""
        if not self.is_known or self.variance <= UNDERTOLD * (1.0 + FEW / self.samples) * told:
            return told
        return self.variance


class Coloured(NamedTuple):
    """How the errors of a sensor come: from sample to sample, and from second to second."""

    lasting: float = 1.0
    """How much more of its errors lasts longer than from second to second; counts where those are seen."""
    quick: Scatter = Scatter()
    slow: Scatter = Scatter(least=SLOW_LEAST)
    since_ns: int = 0
    """Begin of the present second, ..."""
    sum_s: float = 0.0
    """... the integral of the values in it, ..."""
    summed_s: float = 0.0
    """... and over which time."""

    def after(
        self, t_ns: int, value: float, told: float, elapsed_s: float, swing: float | None, far: float = SLOW_FAR
    ) -> Coloured:
        """Note the mean over a step, of such a variance.

        Without a `swing` means over a second are noted, too; else the brake makes the values swing by such a variance.
        """
        quick = self.quick.after(t_ns, value, told, swing or 0.0)
        if swing is not None:
            return self._replace(quick=quick, summed_s=0.0)
        if not self.summed_s or t_ns - self.since_ns > 2 * S:
            return self._replace(quick=quick, since_ns=t_ns, sum_s=value * elapsed_s, summed_s=elapsed_s)
        sum_s, summed_s = self.sum_s + value * elapsed_s, self.summed_s + elapsed_s
        if t_ns - self.since_ns < S:
            return self._replace(quick=quick, sum_s=sum_s, summed_s=summed_s)
        span_ns = max(SPAN_NS, round(SELDOM * (1.0 + elapsed_s) * S))
        slow = self.slow.after(t_ns, sum_s / summed_s, told * elapsed_s / summed_s, far=far, span_ns=span_ns)
        return Coloured(self.lasting, quick, slow)

    def variance_of(self, told: float, elapsed_s: float) -> float:
        """Variance of the mean over a step whose messages tell such a one, as if its errors did not last."""
        quick, least = self.quick.variance_of(told), told * elapsed_s
        slow = self.slow.variance_of(least)
        return max(quick, self.lasting * slow / elapsed_s) if slow > least else quick

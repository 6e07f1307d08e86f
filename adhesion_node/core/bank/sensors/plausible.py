# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whether positions are the train's: of a wheel that slides they show what no brake gives, or run off in turns."""

from __future__ import annotations

import math
from bisect import bisect_left
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...physics.train import Array
from ...quick import quick
from ..kernels import parabola
from ..labels import noises
from ..layout import Bank
from ..motion import white_variance
from . import rolling
from .possible import SURELY, Possible, possible_of
from .rolling import Rolling
from .wandering import Wandering

if TYPE_CHECKING:
    from ...config import Config

S = 1_000_000_000

LOOKS_S, SPANNED, SIGMA = (3.0, 1.5), 0.8, 5.0
"""Times over which positions are looked at, the part of one that they must span, as the error is reckoned for all of
it, and the standard deviations beyond which no train brakes so: twice a second for minutes four come by chance."""

SPAN_NS, LEAST = round(max(rolling.LOOKS_S) * S), 8
"""Time of the positions that are kept, and how many must be looked at together."""

WHITE, WANDERING = 720.0, 34.0
"""Variance of the deceleration of a parabola through n positions over a time T: so many times that of white errors over
n T^4, or that of errors which wander, over the time that they last and T^3. At the part u of the time a position weighs
360 (u^2 - u + 1/6)/T^2: the mean square of that is 720/T^4, the one of its integral, twice, 240/7."""

STEPPED = 10.0 / math.sqrt(3.0)
"""A step of the positions is a deceleration of at most so many times its size over T^2: the integral of that weight."""

FAR, FORESEEN, RUNS_OFF = 5.0, 2.0, 15.5
"""Deviations by the hypothesis nearest count as no more than so many standard deviations. Of the product of one and the
next so much is foreseen each time; what is more is summed up, and above the last runs off (Page 1954). Errors that come
by chance, however large, do not follow each other so, and those that wander are foreseen."""

BURST_NS = 150_000_000
"""Positions not believed that follow each other sooner have one cause, as a signal that is reflected."""

BRAKED_NS = 3 * S
"""A train that has been braked so long gains no speed."""


@quick
class Course(NamedTuple):
    """Positions of the last seconds, stamps in ns and m."""

    recent: tuple[tuple[int, float], ...] = ()
    braked_ns: int | None = None
    """Since when the brake is applied, ..."""
    rolls_ns: int | None = None
    """... or since when it is not."""
    wandering: Wandering = Wandering()
    rolling: Rolling = Rolling()
    stepped_ns: int = -SPAN_NS
    """Stamp of the last step of the positions, ..."""
    stepped_m: float = 0.0
    """... and the sizes of all that follow each other within `SPAN_NS`."""
    heard_ns: int = 0
    """Stamp of the newest, believed or not, ..."""
    off: float = 0.0
    """... how far off it was, in standard deviations, ..."""
    running: float = 0.0
    """... and how far they run off."""

    def after(self, t_ns: int, position_m: float, braked: bool, off: float | None, tells: bool = True) -> Course:
        """With the next position, and how far off it is in standard deviations by the hypothesis nearest, if known.

        One that does not tell may have stepped: it adds nothing to what runs off.
        """
        first, end = bisect_left(self.recent, (t_ns - SPAN_NS,)), bisect_left(self.recent, (t_ns,))
        recent, since_ns = (*self.recent[first:end], (t_ns, position_m)), self.braked_ns if braked else self.rolls_ns
        since_ns = t_ns if since_ns is None else since_ns
        if braked:
            return self._replace(recent=recent, braked_ns=since_ns, rolls_ns=None)._running(t_ns, off, tells)
        now = self._replace(recent=recent, braked_ns=None, rolls_ns=since_ns, off=0.0, running=0.0)
        return now._running(t_ns, off, tells)

    def stepped(self, t_ns: int, size_m: float) -> Course:
        """Where the positions have stepped by so much, from such a one on: an axle that slides may look so."""
        before_m = self.stepped_m if t_ns - self.stepped_ns < SPAN_NS else 0.0
        braked_ns, rolls_ns = (None if since_ns is None else t_ns for since_ns in (self.braked_ns, self.rolls_ns))
        stepped_m = before_m + abs(size_m)
        unseen = self.wandering.unseen(), self.rolling.unseen()
        return Course(self.recent, braked_ns, rolls_ns, *unseen, t_ns, stepped_m)

    def forgotten(self) -> Course:
        """With what is known of how the positions err, alone."""
        return Course(wandering=self.wandering.unseen(), rolling=self.rolling.unseen())

    def rolled(self, speed_mps: float) -> Course:
        """With a look at how the positions of a train err that no brake slows down."""
        time, places = self._from_newest(self.recent[-1][0] if self.rolls_ns is None else self.rolls_ns)
        seen = self._replace(rolling=self.rolling.after(time, places, speed_mps))
        first = _seen(time, LOOKS_S[0])
        if first is None:
            return seen._replace(wandering=self.wandering.unseen())
        slowing = -2.0 * parabola.curvature(time[first:], places[first:])
        return seen._replace(wandering=self.wandering.after(slowing, LOOKS_S[0] ** 3 / WANDERING, speed_mps))

    def outlying(self, t_ns: int, off: float, tells: bool = True, rolled_m: float | None = None) -> Course:
        """With a position that is not believed: such as come soon are of one burst.

        A wheel's that comes seldom and lies behind is looked at as the others are: it does not err by chance.
        """
        if t_ns - self.heard_ns < BURST_NS:
            return self._replace(heard_ns=t_ns)
        if rolled_m is None or off > 0.0 or len(self.recent) >= rolling.SELDOM:
            return self._running(t_ns, off, tells)
        return self._replace(recent=(*self.recent, (t_ns, rolled_m)))._running(t_ns, off, tells)

    def _running(self, t_ns: int, off: float | None, tells: bool) -> Course:
        if off is None:
            return self._replace(heard_ns=t_ns)
        off = min(max(off, -FAR), FAR)
        running = max(self.running + tells * max(off * self.off, 0.0) - FORESEEN, 0.0)
        return self._replace(heard_ns=t_ns, off=off, running=running)

    @property
    def runs_off(self) -> bool:
        """Whether the positions under the brake run off in a way that none of the known errors does."""
        return self.running > RUNS_OFF

    def is_impossible(
        self,
        config: Config,
        bank: Bank,
        declared_m: float,
        rounded_m: float = 0.0,
        rolled: bool = False,
        applied: float = 0.0,
    ) -> bool:
        """Whether no train moves so: they run off, or parabolas through them say so in spite of their errors.

        A wheel's are known to err by as much as they have shown, whatever brake is `applied`, over the weight.
        """
        if self.runs_off or self.braked_ns is None:
            return self.runs_off
        time, places = self._from_newest()
        settled_s = (self.braked_ns + BRAKED_NS - self.recent[-1][0]) / S
        if rolled and self.rolling.is_learnt:
            possible = possible_of(config, bank, places, applied, SURELY)
            return self.rolling.slides(time, places, rounded_m, settled_s, possible)
        errors, possible = _errors(bank, declared_m, rounded_m), possible_of(config, bank, places)
        return len(self.recent) >= LEAST and self._strays(time, places, errors, settled_s, possible)

    def _strays(
        self, time: Array, places: Array, errors: tuple[float, float], settled_s: float, possible: Possible
    ) -> bool:
        white, slow = errors
        seen = self.wandering.of(slow)
        for span_s in LOOKS_S:
            first = _seen(time, span_s)
            if first is None:
                continue
            slowing = -2.0 * parabola.curvature(time[first:], places[first:])
            shifted = STEPPED * self.stepped_m / span_s**2 if self.stepped_ns >= self.recent[first][0] else 0.0
            if slowing > possible.most_mps2 + shifted + SIGMA * _error(white, seen, span_s, time.size - first):
                return True
            error = shifted + SIGMA * _error(white, slow, span_s, time.size - first)
            if time[first] >= settled_s and slowing < possible.least_mps2 - error:
                return True
        return False

    def _from_newest(self, since_ns: int | None = None) -> tuple[Array, Array]:
        """Times, s, and positions, m, of the last seconds from the newest on."""
        newest_ns, newest_m = self.recent[-1]
        recent = [each for each in self.recent if since_ns is None or each[0] >= since_ns]
        time = np.array([(t_ns - newest_ns) / S for t_ns, _ in recent])
        return time, np.array([place_m - newest_m for _, place_m in recent])


def _seen(time: Array, span_s: float) -> int | None:
    """Index of the first position of a look over so long, if there are enough."""
    first = int(time.searchsorted(-span_s))
    return first if time.size - first >= LEAST and time[first] <= -SPANNED * span_s else None


def _errors(bank: Bank, declared_m: float, rounded_m: float = 0.0) -> tuple[float, float]:
    """Mean variance of the white errors, m^2, and of the worst that wander over the time that they last, m^2/s."""
    white, slow = float(bank.weight @ white_variance(bank, declared_m, rounded_m)), _wandering(declared_m)
    return white, max(slow[noise] for noise in {noises.RECEIVER, *bank.noise.tolist()})


@lru_cache(maxsize=64)  # a receiver mostly declares the same
def _wandering(declared_m: float) -> tuple[float, ...]:
    return tuple(noise.stds_m(declared_m)[1] ** 2 / noise.lasts_s for noise in noises.NOISES)


def _error(white: float, slow: float, span_s: float, count: int) -> float:
    """Standard deviation of the parabola's deceleration, m/s^2, by white errors and by the worst that wander."""
    return math.sqrt(WHITE * white / (count * span_s**4) + WANDERING * slow / span_s**3)

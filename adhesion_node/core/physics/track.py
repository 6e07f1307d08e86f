# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Additional resistance along the track: grades, curves and tunnels, Xie et al. 2019, (7)-(10).

All resistances are per weight (N/N), so that they do not depend on the train's mass. A position is that of the front
end. Grades and curves pull at every wagon that is on them, so they count in the mean over the length of the train.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import astuple, dataclass, field, replace
from numbers import Real
from typing import overload

import numpy as np

from .train import Array


@dataclass(frozen=True, slots=True)
class Grade:
    """A constant grade that rises `rise_m` (negative: falls) from `start_m` to `end_m`."""

    start_m: float
    end_m: float
    rise_m: float

    def resistance(self, train_length_m: float) -> float:
        """Grade resistance h/l, N/N (8), with as much of it under the train as there can be.

        >>> Grade(0.0, 2000.0, 10.0).resistance(200.0), Grade(0.0, 100.0, 1.0).resistance(200.0)
        (0.005, 0.005)
        """
        return self.rise_m / max(self.end_m - self.start_m, train_length_m)


@dataclass(frozen=True, slots=True)
class Curve:
    """A circular curve of `radius_m` that turns the track by `angle_deg` degrees."""

    start_m: float
    end_m: float
    radius_m: float
    angle_deg: float

    def resistance(self, train_length_m: float) -> float:
        """Curve resistance, N/N (9): 0.6/R for a curve longer than the train, else 0.0105 alpha/L.

        >>> Curve(0.0, 1000.0, 4800.0, 12.0).resistance(200.0)
        0.000125
        >>> round(Curve(0.0, 100.0, 6000.0, 1.0).resistance(200.0), 7)
        5.25e-05
        """
        if train_length_m < self.end_m - self.start_m:
            return 0.6 / self.radius_m
        return 0.0105 * self.angle_deg / train_length_m


@dataclass(frozen=True, slots=True)
class Tunnel:
    """A tunnel."""

    start_m: float
    end_m: float

    def resistance(self, train_length_m: float) -> float:
        """Tunnel air resistance 0.00013e-3 L, N/N with the length L in m (10).

        >>> round(Tunnel(0.0, 1000.0).resistance(200.0), 8)
        0.00013
        """
        return 0.00013e-3 * (self.end_m - self.start_m)


Section = Grade | Curve | Tunnel

STEEPEST, TIGHTEST_M = 0.15, 10.0
"""Grade and radius of trams in Lisbon and Toronto, rounded outwards: beyond them a profile is a slip of the pen."""

LONGEST_TUNNEL_M = 70e3
"""No railway's is longer. The air's resistance grows with its length: all of a line as one seems to brake a train."""

RAMP = 8
"""Steps on a train's length in which what lies under it changes."""

EVEN = 1e-12
"""Difference of grades that is none, but of rounding."""

MANY = 1000
"""Positions for which a look at their ends pays: most often they all lie between the same two borders."""


@dataclass(frozen=True)
class Track:
    """A track profile: sections may overlap; outside them the track is level, straight and open.

    `train_length_m` is that of the train: a grade and a curve come under it, and leave it, in `RAMP` steps.

    Raises ValueError naming the section when it is none, does not end beyond its start, or is steeper, tighter or
    further in a tunnel than any train could pass.
    """

    sections: tuple[Section, ...] = ()
    train_length_m: float = 200.0
    _breaks: Array = field(init=False, repr=False, compare=False)
    _levels: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (isinstance(self.train_length_m, Real) and 0.0 < self.train_length_m < math.inf):
            raise ValueError(f"track train_length_m = {self.train_length_m!r}: give a length above 0 m")
        if not isinstance(self.sections, tuple | list):
            raise ValueError(f"track sections = {self.sections!r}: give a tuple of them, (Grade(0.0, 2000.0, 10.0),)")
        for section in self.sections:
            if not isinstance(section, Section):
                raise ValueError(f"track section {section!r}: give a Grade, a Curve or a Tunnel")
            if not (all(map(math.isfinite, astuple(section))) and section.end_m > section.start_m):
                raise ValueError(f"track section {section}: give finite numbers and an end_m beyond start_m")
            if isinstance(section, Curve) and not section.radius_m >= TIGHTEST_M:
                raise ValueError(f"track section {section}: give a radius_m of at least {TIGHTEST_M:g} m")
            if isinstance(section, Curve) and section.angle_deg < 0.0:
                raise ValueError(f"track section {section}: give an angle_deg of at least 0, to either side")
            if isinstance(section, Tunnel) and section.end_m - section.start_m > LONGEST_TUNNEL_M:
                raise ValueError(
                    f"track section {section}: none is longer than {LONGEST_TUNNEL_M / 1e3:g} km: give each by itself"
                )
            if isinstance(section, Grade) and abs(section.resistance(0.0)) > STEEPEST:
                steep = f"{100.0 * section.resistance(0.0):.3g} %"
                raise ValueError(
                    f"track section {section}: rises by {steep}, and trains climb {100.0 * STEEPEST:g} % at most: "
                    "rise_m is the height gained between both ends, in m"
                )
        breaks, levels = _under_train(
            [one for one in self.sections if not isinstance(one, Tunnel)], self.train_length_m
        )
        for tunnel in (one for one in self.sections if isinstance(one, Tunnel)):
            breaks, levels = _with_tunnel(breaks, levels, tunnel)
        object.__setattr__(self, "_breaks", breaks)
        object.__setattr__(self, "_levels", levels)

    @overload
    def specific_resistance(self, position_m: float) -> float: ...

    @overload
    def specific_resistance(self, position_m: Array) -> Array: ...

    def specific_resistance(self, position_m: float | Array) -> float | Array:
        """Sum of grade, curve and tunnel resistance R2/(M g), N/N, with the front end at each position (7)."""
        if isinstance(position_m, float):
            return float(self._levels[bisect_right(self._breaks, position_m)])
        if not self.sections:
            return np.zeros_like(position_m)
        if position_m.size >= MANY:
            first, last = self._breaks.searchsorted((position_m.min(), position_m.max()), side="right")
            if first == last:
                return np.full(position_m.shape, self._levels[first])
        return self._levels[self._breaks.searchsorted(position_m, side="right")]

    @property
    def steps(self) -> tuple[Array, Array]:
        """Where the resistance changes, m, and its values before, between and behind, N/N."""
        return self._breaks, self._levels

    def turned(self) -> "Track":
        """The same track run the other way: positions change their sign, climbs fall."""
        return Track(tuple(_turned(section) for section in self.sections), self.train_length_m)

    def off(self, least_m: float, most_m: float) -> float:
        """How far the nearest section is from a stretch, m, below 0 behind it; 0 where one lies on it, or none is."""
        gaps = [max(s.start_m - most_m, 0.0) or min(s.end_m - least_m, 0.0) for s in self.sections]
        return min(gaps, key=abs, default=0.0)

    def least_resistance(self, from_m: float, to_m: float) -> float:
        """Smallest resistance, N/N, between two positions: what a braking curve over them may count on."""
        first, last = self._breaks.searchsorted((from_m, to_m), side="right")
        return float(self._levels[first : last + 1].min())


def _under_train(sections: Sequence[Grade | Curve], train_m: float) -> tuple[Array, Array]:
    """Where the mean of grades and curves under a train changes, by its front end, and its values before and behind.

    What a curve resists with counts as a height that the train gains on it. Between the ends of sections, and a train's
    length behind them, the mean changes linearly: in `RAMP` steps per train, each as high as the mean in it.

    >>> breaks, levels = _under_train([Grade(0.0, 1000.0, 8.0)], 200.0)
    >>> breaks[[0, 1, 8, 9, -1]], levels[[0, 1, 9, -2, -1]]
    (array([   0.,   25.,  200., 1000., 1200.]), array([0.    , 0.0005, 0.008 , 0.0005, 0.    ]))
    """
    if not sections:
        return np.empty(0), np.zeros(1)
    ends = np.unique(np.array([(one.start_m, one.end_m) for one in sections], np.float64))
    density = np.zeros(ends.size - 1)
    for one in sections:
        first, last = ends.searchsorted((one.start_m, one.end_m))
        length_m = one.end_m - one.start_m
        density[first:last] += one.resistance(train_m) * max(length_m, train_m) / length_m
    height = np.append(0.0, np.cumsum(density * np.diff(ends)))
    knots = np.unique(np.append(ends, ends + train_m))
    mean = (np.interp(knots, ends, height) - np.interp(knots - train_m, ends, height)) / train_m
    steps = np.where(np.abs(np.diff(mean)) < EVEN, 1.0, np.ceil(RAMP * np.diff(knots) / train_m))
    number = np.append(0.0, np.cumsum(steps))
    places = np.arange(number[-1] + 1.0)
    at = np.interp(places, number, mean)
    return np.interp(places, number, knots), np.concatenate(([0.0], (at[:-1] + at[1:]) / 2, [0.0]))


def _with_tunnel(breaks: Array, levels: Array, tunnel: Tunnel) -> tuple[Array, Array]:
    """The same with a tunnel."""
    ends = np.unique(np.append(breaks, (tunnel.start_m, tunnel.end_m)))
    middle = np.concatenate(([-np.inf], (ends[:-1] + ends[1:]) / 2, [np.inf]))
    found = levels[breaks.searchsorted(middle, side="right")]
    first, last = ends.searchsorted((tunnel.start_m, tunnel.end_m))
    found[first + 1 : last + 1] += tunnel.resistance(0.0)
    return ends, found


def _turned(section: Section) -> Section:
    """The section run the other way.

    >>> _turned(Grade(0.0, 2000.0, 10.0))
    Grade(start_m=-2000.0, end_m=-0.0, rise_m=-10.0)
    """
    turned = replace(section, start_m=-section.end_m, end_m=-section.start_m)
    return replace(turned, rise_m=-turned.rise_m) if isinstance(turned, Grade) else turned


def parse_track(text: str, train_length_m: float) -> Track:
    """Build a track from a text such as "grade 0 2000 10; curve 500 1500 4800 12; tunnel 1000 3000".

    The numbers are those of `Grade`, `Curve` and `Tunnel` in m and degrees. Raises ValueError naming the section.

    >>> parse_track("grade 0 2000 10", 200.0).sections
    (Grade(start_m=0.0, end_m=2000.0, rise_m=10.0),)
    """
    kinds: dict[str, type[Section]] = {"grade": Grade, "curve": Curve, "tunnel": Tunnel}
    sections = []
    for entry in filter(str.strip, text.split(";")):
        kind, *numbers = entry.split()
        try:
            sections.append(kinds[kind](*map(float, numbers)))
        except (KeyError, TypeError, ValueError):
            raise ValueError(
                f"track section {entry.strip()!r}: write 'grade START END RISE', 'curve START END RADIUS ANGLE' or "
                "'tunnel START END', in m and degrees, separated by ';'"
            ) from None
    return Track(tuple(sections), train_length_m)


LEVEL = Track()
"""Level, straight, open line."""

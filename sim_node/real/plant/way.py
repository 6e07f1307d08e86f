# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The way: mu0 of the rail and the grade, drawn along the track for one run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .creep import Contact, contact
from .journey import Array
from .train import Nominal

CELL_M = 1.0
"""Spacing of the places at which the way is drawn; between them it is straight."""

ROUGHNESS, CORRELATION_M = 0.05, 100.0
"""Log-normal: standard deviation of log mu0, and length after which its correlation has fallen to 1/e."""

WAVES_M = (1000.0, 4000.0)
"""Shortest and longest wave of a grade that undulates."""

CLEANED_BY = 4.0
"""Groups after which the cleaning of the rail is down to 1/e of what is still to come."""


@dataclass(frozen=True, slots=True)
class Rail:
    """The rail of a scenario. Its mu0 is the mean over the train: the first group meets less, the last more."""

    level: Callable[[Array, np.random.Generator], Array]
    """mu0 at places, m, shape (N,)."""
    cleaning: float = 1.0
    """mu0 under the last group over that under the first."""
    level_std: float = 0.10
    """Standard deviation between days, of log mu0 of the whole way."""
    roughness: float = ROUGHNESS

    def cleaned(self, groups: int) -> Array:
        """Return the factor on mu0 of every group, shape (A,): what passed before it has cleaned the rail."""
        passed = -np.expm1(-np.arange(groups) / CLEANED_BY)
        factor = 1.0 + (self.cleaning - 1.0) * passed / passed[-1]
        return np.asarray(factor / factor.mean())


Grade = Callable[[Array, np.random.Generator], Array]
"""Rise over run at places, m, shape (N,)."""


class Way(NamedTuple):
    """What is drawn of one run, at places every `CELL_M` from `start_m` on; shape (N,) or (N, 5)."""

    start_m: float
    contact: Array
    """mu0, k_A, k_S, A, B of the rail before any cleaning."""
    grade: Array
    """Mean under a train whose front is at the place."""


def draw(rail: Rail, grade: Grade, train_m: float, way_m: float, rng: np.random.Generator) -> Way:
    """Draw the way under a train from its rear at the start to `way_m` before it."""
    start = -CELL_M * np.ceil(train_m / CELL_M + 1.0)
    place = np.arange(start, way_m + CELL_M, CELL_M)
    day = rail.level_std * np.clip(rng.standard_normal(), -2.0, 2.0)
    rough = rail.roughness * correlated(place.size, CELL_M / CORRELATION_M, rng)
    mu0 = rail.level(place, rng) * np.exp(day + rough)
    height = np.concatenate([[0.0], np.cumsum(grade(place, rng)[:-1]) * CELL_M])
    mean = (height - np.interp(place - train_m, place, height)) / train_m
    return Way(float(start), np.stack(contact(mu0), axis=-1), mean)


class Ground:
    """The ways of R runs under the groups of their trains; places between the cells are interpolated."""

    def __init__(self, ways: Sequence[Way], rail: Rail, nominal: Nominal) -> None:
        self._start, self._count = ways[0].start_m, ways[0].grade.size
        self._contact = np.concatenate([one.contact for one in ways])
        self._grade = np.concatenate([one.grade for one in ways])
        self._first = (np.arange(len(ways)) * self._count)[:, None]
        self._offsets, self._cleaned = nominal.offsets(), rail.cleaned(nominal.groups)

    def contact(self, front_m: Array) -> Contact:
        """Return what the groups meet, (R, A), of trains whose fronts are at (R, 1)."""
        low, share = self._at(front_m - self._offsets)
        first = self._contact.take(low, axis=0)
        values = first + share[..., None] * (self._contact.take(low + 1, axis=0) - first)
        mu0, *shape = (values[..., i] for i in range(values.shape[-1]))
        return Contact(mu0 * self._cleaned, *shape)

    def grade(self, front_m: Array) -> Array:
        """Return the mean grade under the trains, (R, 1)."""
        low, share = self._at(front_m)
        return np.asarray(self._grade[low] + share * (self._grade[low + 1] - self._grade[low]))

    def _at(self, place_m: Array) -> tuple[NDArray[np.intp], Array]:
        """Cells before the places, and how far behind them these are, in cells."""
        cells = (place_m - self._start) / CELL_M
        low = np.minimum(cells.astype(np.intp), self._count - 2)
        return low + self._first, cells - low


def correlated(count: int, step: float, rng: np.random.Generator) -> Array:
    """Draw a stationary Gauss-Markov sequence of variance 1; `step` in correlation lengths."""
    from scipy.signal import lfilter  # takes half a second, which a run of the paper's simulator need not wait

    keep = np.exp(-step)
    drawn = rng.standard_normal(count)
    drawn[1:] *= np.sqrt(1.0 - keep * keep)
    return np.asarray(lfilter([1.0], [1.0, -keep], drawn))


def steady(mu0: float) -> Callable[[Array, np.random.Generator], Array]:
    """One level everywhere; a grade, too."""
    return lambda place, rng: np.full(place.shape, mu0)


def along(*points: tuple[float, float]) -> Callable[[Array, np.random.Generator], Array]:
    """Straight between (place, m; level), level outside."""
    places, levels = np.array(points).T
    return lambda place, rng: np.interp(place, places, levels)


def patches(
    base: float, patch: float, between_m: tuple[float, float], length_m: tuple[float, float]
) -> Callable[[Array, np.random.Generator], Array]:
    """Patches of another level, with borders; gaps and lengths are drawn evenly from their ranges."""

    def level(place: Array, rng: np.random.Generator) -> Array:
        count = int(np.ceil(np.ptp(place) / (between_m[0] + length_m[0]))) + 1
        pieces = np.stack([rng.uniform(*between_m, count), rng.uniform(*length_m, count)], axis=1)
        borders = place[0] + np.cumsum(pieces)
        return np.where(np.searchsorted(borders, place, side="right") % 2 == 0, base, patch)

    return level


def undulating(highest: float) -> Grade:
    """Three waves of drawn lengths and phases, together at most `highest`."""

    def grade(place: Array, rng: np.random.Generator) -> Array:
        shortest, longest = WAVES_M
        lengths = shortest * (longest / shortest) ** rng.random(3)
        phases = rng.uniform(0.0, 2.0 * np.pi, 3)
        weights = rng.dirichlet(np.ones(3))
        waves = np.sin(2.0 * np.pi * place[:, None] / lengths + phases) @ weights
        return np.asarray(highest * waves)

    return grade


LEVEL: Grade = steady(0.0)

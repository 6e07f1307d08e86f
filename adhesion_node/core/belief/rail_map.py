# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What earlier trains saw of a line, as a train knows it that begins to brake there.

Either the rail is as it was, or the weather is another, and all that is known is what is known without a map. That it
is as it was is the less probable, the longer ago it was seen and the fewer brakings saw it; the bound is that of both
laws together, so that a map of dry rail is no promise on leaves.
"""

import math
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.adhesion import AdhesionLaw
from ..physics.train import GRAVITY, Array
from .either import LEAST_MU, either
from .rail import Rail

DAY_NS = 86_400_000_000_000

THIN = 3.0
"""Brakings from which a map may make a train less careful, and that say half of what any number of them could."""

FORGOTTEN = 0.05
"""Worth below which what was seen on a date says nothing any more."""

SHOWN = 0.5
"""Where the brake limited, and showed less than this part of what it showed elsewhere, it was only half applied."""

LEAST_M, BRAKES_MPS2, FAR = 200.0, 1.0, 4.0
"""The way that tells of the rail: that of this deceleration to a standstill, and at least so long. So many times as far
it counts whether a stretch was seen."""


class Piece(NamedTuple):
    """What was seen of a piece of track on a date."""

    place_m: float
    """Its lower end."""
    length_m: float
    t_ns: int
    """The newest."""
    seen: int
    """Brakings that showed it."""
    mu: float
    """Mean where adhesion limited, else what was used: there was as much at least."""
    std: float
    lower: float
    speed_mps: float
    """Mean of the trains."""
    limited: bool = True
    """Whether adhesion limited any of them; else there may be far more than `mu`."""


class Way(NamedTuple):
    """What a train is about to brake on: from where, how fast (below 0 where positions fall), and when."""

    position_m: float
    speed_mps: float
    t_ns: int


class Trust(NamedTuple):
    """How far a map is believed: the probability that the rail is as it was seen just now, and how that fades."""

    probability: float
    days: float
    """Time in which it fades to 1/e."""


@dataclass(frozen=True, slots=True)
class RailMap:
    """Pieces of a line in the order of their places; several of one place are of several dates.

    Raises ValueError naming a piece that says nothing or is out of order.
    """

    pieces: tuple[Piece, ...]

    def __post_init__(self) -> None:
        for before, piece in zip((None, *self.pieces), self.pieces, strict=False):
            numbers = (piece.place_m, piece.length_m, piece.mu, piece.std, piece.lower, piece.speed_mps)
            if not all(map(math.isfinite, numbers)) or piece.length_m <= 0.0 or piece.seen < 1 or piece.std < 0.0:
                raise ValueError(f"rail map {piece}: give finite numbers, a length above 0 and seen of at least 1")
            if not 0.0 <= piece.lower <= piece.mu <= 1.0:
                raise ValueError(f"rail map {piece}: give mu from 0 to 1, and no lower above it")
            if before is not None and before.place_m > piece.place_m:
                raise ValueError(f"rail map {piece}: lies before the one before it: sort them by place_m")

    def turned(self) -> "RailMap":
        """The same line run the other way: positions change their sign."""
        turned = (piece._replace(place_m=-piece.place_m - piece.length_m) for piece in reversed(self.pieces))
        return RailMap(tuple(turned))

    def informed(self, rail: Rail, way: Way, law: AdhesionLaw, trust: Trust) -> Rail:
        """What is known of a rail, and by the map, at the beginning of a braking.

        `law` is how adhesion falls with speed: a rail seen by a slow train gives less to a fast one. A stretch that few
        brakings showed gives no more than without a map, and nowhere on its way may the train be foreseen slower than
        by what every stretch so far gives.
        """
        reach_m = max(way.speed_mps**2 / (2.0 * BRAKES_MPS2), LEAST_M)
        known = list(self._known(way, reach_m, trust.days))
        if not known:
            return rail
        stretches = _stretches([piece for piece, _ in self._known(way, FAR * reach_m, trust.days)], way, FAR * reach_m)
        near = np.clip(reach_m - stretches.starts_m, 0.0, stretches.lengths_m)
        worth, seen = float(np.mean([worth for _, worth in known])), _joined(known, law, way.speed_mps)
        thin = float(near @ stretches.brakings) < THIN * reach_m

        def told(count: int) -> Rail:
            one = either(seen, rail, trust.probability * worth * count / (count + THIN))
            if count >= THIN and not thin:
                return one
            return Rail(min(one.mu, rail.mu), max(one.std, rail.std), min(one.lower, rail.lower))

        by_count = {count: told(count) for count in set(stretches.brakings.tolist())}
        of_way = np.array([by_count[count] for count in stretches.brakings.tolist()])
        stops, lower = way.speed_mps**2 / (2.0 * GRAVITY), np.minimum(of_way[:, 2], stretches.lowest)
        mu = _foreseen(stretches.lengths_m, of_way[:, 0], rail.mu, stops)
        std = float(of_way[near > 0.0, 1].max())
        return Rail(mu, std, min(_foreseen(stretches.lengths_m, lower, rail.lower, stops), mu))

    def _known(self, way: Way, reach_m: float, days: float) -> Iterator[tuple[Piece, float]]:
        """The pieces ahead that were seen before now, with what they are worth by their age."""
        from_m, to_m = _ends(way, reach_m)
        longest = max((piece.length_m for piece in self.pieces), default=0.0)
        for piece in self.pieces[bisect_left(self.pieces, from_m - longest, key=attrgetter("place_m")) :]:
            if piece.place_m >= to_m:
                return
            worth = math.exp(-(way.t_ns - piece.t_ns) / DAY_NS / days) if piece.t_ns <= way.t_ns else 0.0
            if worth >= FORGOTTEN and piece.place_m + piece.length_m > from_m:
                yield piece, worth


class Stretches(NamedTuple):
    """A way in parts, in its order, on each of which the same pieces tell; arrays of (n,)."""

    starts_m: Array
    """From the train."""
    lengths_m: Array
    brakings: NDArray[np.int64]
    """How many showed it."""
    lowest: Array
    """The least bound where adhesion limited, else infinite."""


def _ends(way: Way, reach_m: float) -> tuple[float, float]:
    """Between which places a way lies, the lower one first."""
    there = way.position_m + math.copysign(reach_m, way.speed_mps)
    return min(way.position_m, there), max(way.position_m, there)


def _stretches(pieces: Sequence[Piece], way: Way, reach_m: float) -> Stretches:
    ends = _ends(way, reach_m)
    lower, upper = (np.array([piece.place_m + part * piece.length_m for piece in pieces]) for part in (0.0, 1.0))
    edges = np.unique(np.clip(np.concatenate([lower, upper, ends]), *ends))
    middles = 0.5 * (edges[:-1] + edges[1:])[:: -1 if way.speed_mps < 0.0 else 1]
    lengths = np.diff(edges)[:: -1 if way.speed_mps < 0.0 else 1]
    shown = (lower <= middles[:, np.newaxis]) & (middles[:, np.newaxis] < upper)
    bounds = np.array([piece.lower if piece.limited else np.inf for piece in pieces])
    lowest = np.where(shown, bounds, np.inf).min(axis=1)
    return Stretches(np.cumsum(lengths) - lengths, lengths, shown @ np.array([piece.seen for piece in pieces]), lowest)


def _foreseen(lengths_m: Array, adhesions: Array, beyond: float, stops: float) -> float:
    """The one adhesion by which a train is at no place slower than by those of the stretches, and of what comes behind.

    `stops` is the sum of adhesion times way, m, that brings it to a standstill.

    >>> way = np.array([100.0, 100.0, 200.0])
    >>> [_foreseen(way, np.array(of_it), 0.02, 12.0) for of_it in ([0.06] * 3, [0.06, 0.02, 0.06], [0.02, 0.06, 0.06])]
    [0.06, 0.04, 0.02]
    >>> round(_foreseen(way, np.array([0.06] * 3), 0.02, 30.0), 4)
    0.0429
    """
    way, lost = np.cumsum(lengths_m), np.cumsum(lengths_m * adhesions)
    behind = int(np.searchsorted(lost, stops))  # the stretch on which it stands, or what comes behind all of them
    last = max(float(adhesions[behind]) if behind < way.size else beyond, LEAST_MU)
    before = (float(way[behind - 1]), float(lost[behind - 1])) if behind else (0.0, 0.0)
    means = [*(lost / way)[:behind].tolist(), stops / max(before[0] + (stops - before[1]) / last, LEAST_MU)]
    return float(np.clip(min(means), min(beyond, adhesions.min()), adhesions[0]))


def _joined(known: Sequence[tuple[Piece, float]], law: AdhesionLaw, speed_mps: float) -> Rail:
    """Mean of what was seen with its scatter, and the least bound; a brake that only builds up shows nothing."""
    most = max(piece.lower for piece, _ in known)
    shown = [(piece, worth) for piece, worth in known if piece.limited or piece.lower >= SHOWN * most]
    seen, fast = [piece for piece, _ in shown], float(law(np.array(abs(speed_mps))))
    falls = np.minimum(fast / law(np.array([piece.speed_mps for piece in seen])), 1.0)
    weights = np.array([piece.seen * worth for piece, worth in shown])
    mu, std, lower = (falls * [getattr(piece, name) for piece in seen] for name in ("mu", "std", "lower"))
    mean = float(np.average(mu, weights=weights))
    variance = float(np.average(std**2 + (mu - mean) ** 2, weights=weights))
    return Rail(mean, math.sqrt(variance), min(float(lower.min()), mean))

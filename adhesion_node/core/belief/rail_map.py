# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

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
from scipy.special import ndtr, ndtri

from ..physics.adhesion import AdhesionLaw
from .rail import Rail

DAY_NS = 86_400_000_000_000

THIN = 3.0
"""Brakings from which a map may make a train less careful, and that say half of what any number of them could."""

FORGOTTEN = 0.05
"""Worth below which what was seen on a date says nothing any more."""

SHOWN = 0.5
"""Where the brake limited, and showed less than this part of what it showed elsewhere, it was only half applied."""

LEAST_M, BRAKES_MPS2 = 200.0, 1.0
"""The way that is looked ahead: that of this deceleration to a standstill, and at least so long."""

MISSED, LEAST_MU, LEAST_STD, BISECTIONS = 0.05, 1e-3, 1e-3, 40
"""What a bound misses; numbers that keep logarithms finite; steps to the bound."""


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

        `law` is how adhesion falls with speed: a rail seen by a slow train gives less to a fast one.
        """
        reach_m = max(way.speed_mps**2 / (2.0 * BRAKES_MPS2), LEAST_M)
        ends = sorted((way.position_m, way.position_m + math.copysign(reach_m, way.speed_mps)))
        known = list(self._known(ends[0], ends[1], way.t_ns, trust.days))
        if not known:
            return rail
        places = {piece.place_m: piece.length_m for piece, _ in known}
        covered = min(sum(places.values()) / reach_m, 1.0)
        brakings = covered * sum(piece.seen for piece, _ in known) / len(places)
        worth = float(np.mean([worth for _, worth in known]))
        seen = _joined(known, law, way.speed_mps)
        told = _either(seen, rail, trust.probability * worth * brakings / (brakings + THIN))
        if brakings >= THIN:
            return told
        return Rail(min(told.mu, rail.mu), max(told.std, rail.std), min(told.lower, rail.lower))

    def _known(self, from_m: float, to_m: float, now_ns: int, days: float) -> Iterator[tuple[Piece, float]]:
        """The pieces between two places that were seen before now, with what they are worth by their age."""
        longest = max((piece.length_m for piece in self.pieces), default=0.0)
        for piece in self.pieces[bisect_left(self.pieces, from_m - longest, key=attrgetter("place_m")) :]:
            if piece.place_m >= to_m:
                return
            worth = math.exp(-(now_ns - piece.t_ns) / DAY_NS / days) if piece.t_ns <= now_ns else 0.0
            if worth >= FORGOTTEN and piece.place_m + piece.length_m > from_m:
                yield piece, worth


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


def _either(seen: Rail, otherwise: Rail, probability: float) -> Rail:
    """The one rail with a probability, else the other; each law is that of its mean and its bound of 95 %.

    >>> nothing = Rail(0.06, 0.04, 0.02)
    >>> [round(_either(Rail(0.10, 0.005, 0.09), nothing, p).lower, 4) for p in (0.0, 0.5, 0.9, 1.0)]
    [0.02, 0.0255, 0.06, 0.09]
    """
    mean = otherwise.mu + probability * (seen.mu - otherwise.mu)
    each = ((probability, seen), (1.0 - probability, otherwise))
    variance = sum(share * (rail.std**2 + (rail.mu - mean) ** 2) for share, rail in each)
    low, high = sorted(max(rail.lower, LEAST_MU) for _, rail in each)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = sum(share * _share_below(rail, middle) for share, rail in each)
        low, high = (middle, high) if below < MISSED else (low, middle)
    return Rail(mean, math.sqrt(variance), min(low, mean))


def _share_below(rail: Rail, mu: float) -> float:
    """Probability that a rail gives less, its logarithm being Gaussian."""
    lower = max(rail.lower, LEAST_MU)
    std = max(math.log(max(rail.mu, lower) / lower) / -float(ndtri(MISSED)), LEAST_STD)
    return float(ndtr(math.log(mu / max(rail.mu, lower)) / std))

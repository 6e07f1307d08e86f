# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A recorded run as series over time: what its pictures, tables and pages are made from."""

from collections.abc import Callable, Iterable, Mapping
from itertools import groupby
from operator import attrgetter
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..bag import BagReader
from ..core import Regime
from ..core.physics import braking
from ..core.physics.braking import BrakingCurve
from ..core.physics.train import GRAVITY, Array, Train
from ..wire import topics
from ..wire.codecs import NOMINAL, Line
from ..wire.topics import Topic
from .creep import Curves, read_creep
from .series import (
    NONE,
    Series,
    Times,
    read_last_status,
    read_numbers,
    read_remarks,
    read_series,
    read_status,
    read_topic,
    read_unstamped,
)

FIXED_MU = 0.0726
"""The worst case by which trains brake where the adhesion is not known (Xie et al. 2019)."""

RESULTS = (topics.MU, topics.MU_LOWER, topics.STATE)
"""Without these a recording holds no results."""


IN_WORDS = {
    Regime.COASTING.name: "nothing is claimed",
    Regime.BRAKE_LIMITED.name: "the brake limits",
    Regime.ADHESION_LIMITED.name: "the adhesion limits",
}
"""What limits the motion, by the names of the regimes."""


class Curve(NamedTuple):
    """A predicted braking: at which places, m along the track, the train has which speeds, m/s; arrays of (n,)."""

    t_ns: int
    position_m: Array
    speed_mps: Array

    def distance_to(self, target_mps: float) -> float:
        """Distance, m, from the start of the curve to where the train has the target speed; 0 where it is slower."""
        return abs(float(np.interp(-target_mps, -self.speed_mps, self.position_m) - self.position_m[0]))

    @property
    def braking(self) -> BrakingCurve:
        """The curve from its first place, constant in its deceleration from point to point."""
        way, speed = np.abs(self.position_m - self.position_m[0]), self.speed_mps
        slowing = (speed[:-1] ** 2 - speed[1:] ** 2) / (2.0 * np.maximum(np.diff(way), 1e-6))
        times = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(way) / np.maximum(speed[:-1] + speed[1:], 1e-6))))
        return BrakingCurve(way, speed, np.append(slowing, slowing[-1]), times)


class Band(NamedTuple):
    """A regime and the time for which it held, seconds from the start of the run."""

    start_s: float
    end_s: float
    regime: str


class Run(NamedTuple):
    """The series of a recording; empty where it holds none."""

    true_mu: Series = NONE
    true_position: Series = NONE
    true_speed: Series = NONE
    pressure: Series = NONE
    """Gauge, Pa."""
    mu: Series = NONE
    mu_lower: Series = NONE
    position: Series = NONE
    speed: Series = NONE
    regime: Series = NONE
    safe: tuple[Curve, ...] = ()
    """On mu_lower, a weaker brake and the least resistance of the track; at most one for each estimate."""
    nominal: tuple[Curve, ...] = ()
    """On mu and the identified law over speed."""
    remarks: Series = NONE
    """What the estimator said while all was not well."""
    levels: Series = NONE
    """Of the ATP monitor."""
    changes: Series = NONE
    """Changes of the rail found so far, counted."""
    said: tuple[tuple[int, Mapping[str, float]], ...] = ()
    """Numbers of the ATP monitor by key, at their times."""
    creep: Curves = ()
    """Of the creep estimator."""
    counts: Mapping[str, str] = MappingProxyType({})
    """Last diagnostics by key."""

    @property
    def confidence(self) -> float | None:
        """Of the lower bound; None where the recording does not tell."""
        return float(self.counts["confidence"]) if "confidence" in self.counts else None

    @property
    def learnt(self) -> NDArray[np.bool_]:
        """At which estimates the train braked and its adhesion could be seen, or that it is enough; shape (n,)."""
        nothing = set(self.regime.t_ns[self.regime.values == Regime.COASTING.name].tolist())
        return np.array([t_ns not in nothing for t_ns in self.speed.t_ns.tolist()])

    @property
    def origin_ns(self) -> int:
        """When the run starts."""
        return int(min(series.t_ns[0] for series in (self.speed, self.true_speed) if series.t_ns.size))

    @property
    def way(self) -> tuple[Series, Series]:
        """Place and speed of the train: the true ones where they are known."""
        known = self.true_position.t_ns.size > 0
        return (self.true_position, self.true_speed) if known else (self.position, self.speed)

    @property
    def sign(self) -> int:
        """-1 where the chainage falls along the run."""
        place = self.way[0].values
        return -1 if place[-1] < place[0] else 1

    def seconds(self, t_ns: Times) -> Array:
        """Times as seconds from the start of the run."""
        return np.asarray((t_ns - self.origin_ns) * 1e-9, dtype=np.float64)


def read_run(reader: BagReader, line: Line = NOMINAL) -> Run:
    """Read the series. Raises ValueError when the recording holds no estimates."""
    # mu stands in its stamped form, the deceleration -mu g, where that was recorded.
    stamped = read_series(reader, topics.DECELERATION, lambda read: -read.acceleration_mps2 / GRAVITY)
    run = read_inputs(reader, {}, line)._replace(
        mu=stamped if stamped.t_ns.size else read_unstamped(reader, topics.MU, (topics.STATE,)),
        mu_lower=read_unstamped(reader, topics.MU_LOWER, (topics.STATE, topics.DECELERATION)),
        position=read_series(reader, topics.STATE, attrgetter("position_m"), line),
        speed=read_series(reader, topics.STATE, attrgetter("speed_mps")),
        regime=read_status(reader, topics.DIAGNOSTICS, "regime"),
        safe=_read_curves(reader, topics.BRAKING_CURVE, line),
        nominal=_read_curves(reader, topics.BRAKING_CURVE_NOMINAL, line),
        remarks=read_remarks(reader, topics.DIAGNOSTICS, "regime"),
        levels=read_status(reader, topics.ATP_STATUS, "level"),
        changes=read_status(reader, topics.DIAGNOSTICS, "changes"),
        said=read_numbers(reader, topics.ATP_STATUS, "level"),
        counts=read_last_status(reader, topics.DIAGNOSTICS, "regime"),
    )
    for topic, series in zip(RESULTS, (run.mu, run.mu_lower, run.speed), strict=True):
        if not series.t_ns.size:
            raise ValueError(f"bag = {reader.path}: holds no {topic.name}: record while the estimator runs")
    return run


def read_inputs(reader: BagReader, recorded: Mapping[str, str], line: Line) -> Run:
    """Read truth, creep curves and the brake pressure above the air of `line`, or the demand without a pressure.

    `recorded` has their names in the recording where these differ.
    """

    def series(topic: Topic, value: Callable[[Any], Any]) -> Series:
        return read_series(reader, topic._replace(name=recorded.get(topic.name, topic.name)), value, line)

    pressure = series(topics.BRAKE_PRESSURE, attrgetter("pressure_pa"))
    return Run(
        creep=read_creep(reader),
        true_mu=series(topics.TRUTH_MU, float),
        true_position=series(topics.TRUTH_STATE, attrgetter("position_m")),
        true_speed=series(topics.TRUTH_STATE, attrgetter("speed_mps")),
        pressure=pressure if pressure.t_ns.size else series(topics.BRAKE_DEMAND, attrgetter("pressure_pa")),
    )


def bands(run: Run) -> list[Band]:
    """Regimes over time: an estimate's regime holds since the estimate before it."""
    ends = run.seconds(run.regime.t_ns)
    starts = np.concatenate(([0.0], ends))[:-1]
    rows = [row for row in zip(starts, ends, run.regime.values, strict=True) if row[2]]
    grouped = (list(group) for _, group in groupby(rows, key=lambda row: str(row[2])))
    return [Band(float(group[0][0]), float(group[-1][1]), str(group[0][2])) for group in grouped]


class Distances(NamedTuple):
    """Braking distances, m, at every estimate; arrays of the estimates' shape."""

    fixed: Array
    """By the fixed worst case, on a level track."""
    identified: Array
    """By the nominal curves."""
    longest: Array
    """By the safe curves: not exceeded, with the confidence of the bound."""

    @property
    def saved(self) -> Array:
        """Saved by the identified adhesion against the fixed one; negative where it is lower."""
        return self.fixed - self.identified

    @property
    def saved_at_least(self) -> Array:
        """Saved at least, with the confidence of the bound."""
        return self.fixed - self.longest


def distance_to_target(
    run: Run, mu: Array | float, target_mps: float, train: Train, curves: Iterable[Curve] = ()
) -> Array:
    """Braking distance, m, from the speed at each estimate to the target speed; 0 below it.

    By the one of `curves` that has the estimate's stamp. Where there is none, adhesion stays at its present value `mu`
    on a level track; a bound below 0 counts as no adhesion.
    """
    recorded = {curve.t_ns: curve.distance_to(target_mps) for curve in curves}
    estimates = zip(
        *(a.tolist() for a in (run.speed.t_ns, *np.broadcast_arrays(np.abs(run.speed.values), mu))), strict=True
    )
    return np.array(
        [
            recorded[t_ns]
            if t_ns in recorded
            else braking.curve(train, abs(v), max(held, 0.0), target_mps).distance_m[-1]
            for t_ns, v, held in estimates
        ]
    )


def _read_curves(reader: BagReader, topic: Topic, line: Line) -> tuple[Curve, ...]:
    placed = (sample.read for sample in read_topic(reader, topic, line) if sample.read is not None)
    return tuple(Curve(one.t_ns, one.places_m, one.curve.speed_mps) for one in placed)

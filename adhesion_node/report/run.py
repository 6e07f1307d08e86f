# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A recorded run as series over time: what its pictures, tables and pages are made from."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from operator import attrgetter
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..bag import BagReader
from ..core import Regime
from ..core.physics import braking
from ..core.physics.train import GRAVITY, Array, Train
from ..wire import topics
from ..wire.line import NOMINAL, Line
from ..wire.messages.results import Status
from ..wire.topic import Topic
from .ahead import TOLD
from .creep import CreepCurves, CreepTaken
from .predicted import Curves
from .series import NONE, Keyed, Numbers, Sample, Series, Take, Texts, Times, read_topics, with_key

FIXED_MU = 0.0726
"""The worst case by which trains brake where the adhesion is not known (Xie et al. 2019)."""

RESULTS = (topics.MU, topics.MU_LOWER, topics.STATE)
"""Without these a recording holds no results."""

MOST_SPEEDS = 2000
"""Curves on one adhesion are integrated at so many speeds at most, and interpolated between: to 1 mm at 100 m/s."""

IN_WORDS = {
    Regime.COASTING.name: "nothing is claimed",
    Regime.BRAKE_LIMITED.name: "the brake limits",
    Regime.ADHESION_LIMITED.name: "the adhesion limits",
}
"""What limits the motion, by the names of the regimes."""


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
    safe: Curves = Curves()
    """On mu_lower, a weaker brake and the least resistance of the track; at most one for each estimate."""
    nominal: Curves = Curves()
    """On mu and the identified law over speed."""
    remarks: Series = NONE
    """What the estimator said while all was not well."""
    levels: Series = NONE
    """Of the ATP monitor."""
    changes: Series = NONE
    """Changes of the rail found so far, counted."""
    said: Mapping[str, Series] = MappingProxyType({})
    """Numbers of the ATP monitor by key, NaN where it does not tell one; all at the same times."""
    creep: CreepCurves = ()
    """Of the creep estimator."""
    counts: Mapping[str, str] = MappingProxyType({})
    """Last diagnostics by key."""
    told: Mapping[str, Series] = MappingProxyType({})
    """Further numbers of the estimates, where they were asked for."""

    @property
    def confidence(self) -> float | None:
        """Of the lower bound; None where the recording does not tell."""
        return float(self.counts["confidence"]) if "confidence" in self.counts else None

    @property
    def learnt(self) -> NDArray[np.bool_]:
        """At which estimates the train braked and its adhesion could be seen, or that it is enough; shape (n,)."""
        return np.asarray(self.regimes_at(self.speed.t_ns) != Regime.COASTING.name)

    def regimes_at(self, t_ns: Times) -> NDArray[np.str_]:
        """Regimes of the estimates of those times by name; "" where none is recorded."""
        return self.regime.exactly(t_ns, "").astype(np.str_)

    def __eq__(self, other: object) -> bool:
        """A run is itself alone, so that what follows from it can be kept."""
        return self is other

    def __hash__(self) -> int:
        """By identity, as well."""
        return id(self)

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


def read_run(reader: BagReader, line: Line = NOMINAL, keys: Sequence[str] = (), targets: Sequence[float] = ()) -> Run:
    """Read the series in one pass, and what is told of estimates by `keys`, with the standard deviations of the state.

    The braking distances to `targets`, m/s, are those of every curve. Raises ValueError when the recording holds no
    estimates.
    """
    position, speed = Numbers(attrgetter("position_m")), Numbers(attrgetter("speed_mps"))
    # mu stands in its stamped form, the deceleration -mu g, where that was recorded.
    stamped = Numbers(lambda read: -read.acceleration_mps2 / GRAVITY)
    mu, mu_lower, told, inputs, levels = Numbers(), Numbers(), _Told(), Inputs(), Texts()
    position_std, speed_std = Numbers(attrgetter("position_std_m")), Numbers(attrgetter("speed_std_mps"))
    values, said = Keyed(keys), Keyed(TOLD)
    curves = {topic: Curves(targets) for topic in (topics.BRAKING_CURVE, topics.BRAKING_CURVE_NOMINAL)}
    read_topics(
        reader,
        [
            *inputs.takes,
            *((topic, _curve_taker(each)) for topic, each in curves.items()),
            (topics.MU, mu.take),
            (topics.MU_LOWER, mu_lower.take),
            (topics.STATE, position.take),
            (topics.STATE, speed.take),
            *((topics.STATE, each.take) for each in (position_std, speed_std) if keys),
            (topics.DECELERATION, stamped.take),
            (topics.DIAGNOSTICS, told.take),
            (topics.DIAGNOSTICS, with_key("regime", told.note)),
            (topics.DIAGNOSTICS, with_key("regime", values.note)),
            (topics.ATP_STATUS, with_key("level", said.note)),
            (topics.ATP_STATUS, with_key("level", lambda t_ns, status: levels.add(t_ns, status.values["level"]))),
        ],
        line,
    )
    deceleration = stamped.series
    run = inputs.run._replace(
        mu=deceleration if deceleration.t_ns.size else mu.stamped_by(speed),
        mu_lower=mu_lower.stamped_by(speed, stamped),
        position=position.series,
        speed=speed.series,
        regime=told.regime.series,
        safe=curves[topics.BRAKING_CURVE],
        nominal=curves[topics.BRAKING_CURVE_NOMINAL],
        remarks=told.remarks.series,
        levels=levels.series,
        changes=told.changes.series,
        said=said.series,
        counts=told.counts,
        told={**values.series, "position_std_m": position_std.series, "speed_std_mps": speed_std.series},
    )
    for topic, series in zip(RESULTS, (run.mu, run.mu_lower, run.speed), strict=True):
        if not series.t_ns.size:
            raise ValueError(f"bag = {reader.path}: holds no {topic.name}: record while the estimator runs")
    return run


class Inputs:
    """Truth, creep curves and the brake pressure above the air, or the demand without a pressure, while read."""

    def __init__(self) -> None:
        self.pressure, self.demand = (Numbers(attrgetter("pressure_pa")) for _ in range(2))
        self.creep, self._mu = CreepTaken(), Numbers()
        self._position, self._speed = Numbers(attrgetter("position_m")), Numbers(attrgetter("speed_mps"))
        self.truth: tuple[tuple[Topic, Take], ...] = (
            (topics.TRUTH_MU, self._mu.take),
            (topics.TRUTH_STATE, self._position.take),
            (topics.TRUTH_STATE, self._speed.take),
        )
        """Who takes what of the truth."""

    @property
    def takes(self) -> tuple[tuple[Topic, Take], ...]:
        """Who takes what."""
        pressures = (topics.BRAKE_PRESSURE, self.pressure.take), (topics.BRAKE_DEMAND, self.demand.take)
        return (*self.truth, *pressures, (topics.DIAGNOSTICS, self.creep.take))

    @property
    def run(self) -> Run:
        """What was read."""
        pressure = self.pressure.series
        return Run(
            creep=self.creep.curves,
            true_mu=self._mu.series,
            true_position=self._position.series,
            true_speed=self._speed.series,
            pressure=pressure if pressure.t_ns.size else self.demand.series,
        )


class _Told:
    """What the diagnostics of the estimator tell, while read."""

    def __init__(self) -> None:
        self.regime, self.remarks, self.changes = Texts(), Texts(), Texts()
        self.counts: Mapping[str, str] = {}

    def take(self, sample: Sample) -> None:
        """Take the last values, of no estimate too."""
        self.counts = next((each.values for each in sample.read.entries if "regime" in each.values), self.counts)

    def note(self, t_ns: int, status: Status) -> None:
        """Take what is told of an estimate."""
        self.regime.add(t_ns, status.values["regime"])
        self.remarks.add(t_ns, status.message if status.level else "")
        if "changes" in status.values:
            self.changes.add(t_ns, status.values["changes"])


def _curve_taker(curves: Curves) -> Take:
    def take(sample: Sample) -> None:
        if sample.read is not None:
            t_ns, places = np.atleast_1d(sample.read.t_ns), np.atleast_2d(sample.read.places_m)
            curves.add(t_ns, places, np.atleast_2d(sample.read.curve.speed_mps))

    return take


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
    run: Run, mu: Array | float, target_mps: float, train: Train, curves: Curves | None = None
) -> Array:
    """Braking distance, m, from the speed at each estimate to the target speed; 0 below it.

    By the one of `curves` that has the estimate's stamp. Where there is none, adhesion stays at its present value `mu`
    on a level track; a bound below 0 counts as no adhesion.
    """
    found = (curves or Curves()).lengths(target_mps).exactly(run.speed.t_ns)
    speeds, (held, _) = np.abs(run.speed.values), np.broadcast_arrays(np.maximum(mu, 0.0), found)
    without = np.isnan(found)
    if np.ndim(mu) == 0 and without.sum() > MOST_SPEEDS:
        grid = np.linspace(0.0, speeds.max(), MOST_SPEEDS)
        lengths = [braking.curve(train, v, float(held[0]), target_mps).distance_m[-1] for v in grid.tolist()]
        return np.where(without, np.interp(speeds, grid, lengths), found)
    found[without] = [
        braking.curve(train, v, one, target_mps).distance_m[-1]
        for v, one in zip(speeds[without].tolist(), held[without].tolist(), strict=True)
    ]
    return found

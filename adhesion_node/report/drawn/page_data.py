# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A run as plain numbers for the script of a page: series over time and the braking curves of every moment."""

from typing import Any, NamedTuple

import numpy as np

from ...core import Config
from ...core.physics import braking
from ...core.physics.train import KMH
from ...run.results.known import kind_of
from ..ahead import SHOWN, ahead
from ..found.brakings import Braking, brakings
from ..found.distances import FIXED_MU, Distances, distances
from ..found.events import events
from ..found.findings import first_identified
from ..found.regimes import IN_WORDS, bands
from ..read.predicted import Curve
from ..read.run import Run
from ..read.series import Times
from .charts import Chart, charts
from .creep import creep_data
from .thinning import evenly, number, peaks, rounded, with_gaps

MOST_POINTS, MOST_MOMENTS, CURVE_POINTS = 6000, 800, 32
"""Points of a series, moments of a run and points of a curve at most: a page that is zoomed into shows them all."""

IDLE_MOMENTS = 100
"""Of the moments, those without the brake."""

SAID_NS = 1_500_000_000
"""What the ATP monitor says so soon after an estimate is of its curve."""


class Subject(NamedTuple):
    """A run under its name."""

    name: str
    source: str
    """Where its estimates come from, in words."""
    run: Run
    config: Config
    train: str = ""
    """For which its distances are computed, in words."""
    remarks: tuple[str, ...] = ()
    """What is odd of its sensors and settings."""


def chart_data(subject: Subject, target_kmh: float) -> dict[str, Any]:
    """Return what the script of the report draws; lengths in m, speeds in km/h, forces in kN, times in s.

    Places count from the start of the run, in its direction.
    """
    run, config = subject.run, subject.config
    parts = brakings(run)
    moments = _moments(run, config, distances(run, target_kmh * KMH, config.train), parts)
    first = first_identified(run)
    place, speed = run.way
    kept = evenly(place.t_ns.size, MOST_POINTS)
    way = _way(run, Curve(0, place.values[kept], np.abs(speed.values[kept])))
    forward = np.flatnonzero(np.diff(np.maximum.accumulate([-1.0, *(x if x is not None else -1.0 for x in way["x"])])))
    seconds = run.seconds(run.speed.t_ns)
    fixed = braking.curve(config.train, float(np.abs(run.speed.values).max()), FIXED_MU)
    return {
        "name": subject.name,
        "source": subject.source,
        "bands": [
            {"from": number(band.start_s, 2), "to": number(band.end_s, 2), "kind": band.regime.lower(), "label": label}
            for band in bands(run)
            if (label := IN_WORDS.get(band.regime))
        ],
        "events": [{"x": number(run.seconds(np.array([t_ns]))[0], 2), "kind": kind} for t_ns, kind, _ in events(run)],
        "brakings": [[number(seconds[part.first], 2), number(seconds[part.last], 2)] for part in parts],
        "charts": [_chart(run, chart) for chart in charts(run, target_kmh, config.train)],
        "path": {name: [column[i] for i in forward] for name, column in way.items()},
        "fixed": {"x": rounded(fixed.distance_m, 1), "y": rounded(fixed.speed_mps / KMH, 2)},
        "moments": moments,
        "creep": creep_data(run.creep, run.origin_ns),
        "opens_at": moments[-1]["t"] if first is None else number(seconds[first], 2),
    }


def _kept(run: Run, parts: list[Braking]) -> Times:
    """Indices of the estimates that have a place on the slider: most of them under the brake, where curves are kept."""
    size = run.speed.t_ns.size
    if size <= MOST_MOMENTS or not parts:
        return evenly(size, MOST_MOMENTS)
    each = (MOST_MOMENTS - IDLE_MOMENTS) // len(parts)
    braked = (part.first + evenly(part.last - part.first + 1, max(each, 2)) for part in parts)
    chosen = np.unique(np.concatenate([evenly(size, IDLE_MOMENTS), *braked]))
    drawn = np.flatnonzero(np.isin(run.speed.t_ns, [curve.t_ns for curve in run.safe.kept]))
    if not drawn.size:
        return chosen
    return np.unique(drawn[np.minimum(np.searchsorted(drawn, chosen), drawn.size - 1)])


def _moments(run: Run, config: Config, planned: Distances, parts: list[Braking]) -> list[dict[str, Any]]:
    """What is known at every estimate that has a place on the slider, with the braking curves from there."""
    kept = _kept(run, parts)
    times = run.speed.t_ns[kept]
    safe, nominal = ({curve.t_ns: curve for curve in curves.kept} for curves in (run.safe, run.nominal))
    found = (series.exactly(times).tolist() for series in (run.mu, run.mu_lower))
    columns = (np.abs(run.speed.values[kept]).tolist(), run.position.values[kept].tolist(), *found)
    seconds, regimes, start_m = run.seconds(times), run.regimes_at(times), float(run.way[0].values[0])
    rows = zip(kept.tolist(), times.tolist(), *columns, strict=True)
    return [
        {
            "t": number(seconds[k], 2),
            "speed": number(speed / KMH, 2),
            "place": number(run.sign * (place - start_m), 1),
            "mu": number(mu, 5),
            "mu_lower": number(lower, 5),
            "kind": kind_of(mu, lower, regimes[k]),
            "words": IN_WORDS.get(regimes[k], "regime not recorded"),
            "distance": number(planned.identified[i], 1),
            "longest": number(planned.longest[i], 1),
            "saved_at_least": number(planned.saved_at_least[i], 1),
            "safe": _way(run, _thin(safe[t_ns])) if t_ns in safe else None,
            "nominal": _way(run, _thin(nominal[t_ns])) if t_ns in nominal else None,
            "limits": _limits(run, safe[t_ns]) if t_ns in safe else None,
        }
        for k, (i, t_ns, speed, place, mu, lower) in enumerate(rows)
    ]


def _limits(run: Run, curve: Curve) -> dict[str, Any] | None:
    """The supervision limits ahead, as the ATP monitor had them by this curve."""
    times = run.levels.t_ns
    at = int(np.searchsorted(times, curve.t_ns))
    if at == times.size or times[at] - curve.t_ns > SAID_NS:
        return None
    told = {key: float(series.values[at]) for key, series in run.said.items()}
    numbers = {key: value for key, value in told.items() if np.isfinite(value)}
    if "target_position_m" in numbers:
        numbers["target_position_m"] *= run.sign
    found = ahead(curve.braking, numbers)
    if found is None:
        return None
    start_m = run.sign * float(run.way[0].values[0])
    speeds = {name: rounded(row / KMH, 1) for name, row in zip(SHOWN, found[1:5], strict=True)}
    return {"x": rounded(found.position_m - start_m, 0), **speeds}


def _thin(curve: Curve) -> Curve:
    kept = evenly(curve.position_m.size, CURVE_POINTS)
    return Curve(curve.t_ns, curve.position_m[kept], curve.speed_mps[kept])


def _way(run: Run, curve: Curve) -> dict[str, list[float | None]]:
    start_m = float(run.way[0].values[0])
    return {"x": rounded(run.sign * (curve.position_m - start_m), 1), "y": rounded(curve.speed_mps / KMH, 2)}


def _chart(run: Run, chart: Chart) -> dict[str, Any]:
    lines = []
    for label, kind, series in chart.lines:
        whole = with_gaps(series)
        kept = peaks(np.asarray(whole.values, dtype=np.float64), MOST_POINTS)
        x, y = rounded(run.seconds(whole.t_ns[kept]), 3), rounded(whole.values[kept], chart.digits)
        lines.append({"label": label, "kind": kind, "x": x, "y": y})
    return {"title": chart.title, "range": chart.range, "lines": lines}

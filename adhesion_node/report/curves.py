# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A run as plain numbers for the charts of a page: series over time and the braking curves of every moment."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core import Config, Regime
from ..core.physics import braking
from ..core.physics.train import KMH
from .charts import Chart, charts
from .findings import Distances, distances, first_identified
from .run import FIXED_MU, Curve, Run, bands
from .series import Times

MOST_POINTS = 1500
"""Points of a series at most: more than a screen is wide."""

IN_WORDS = {
    Regime.COASTING.name: "nothing is claimed",
    Regime.BRAKE_LIMITED.name: "the brake limits",
    Regime.ADHESION_LIMITED.name: "the adhesion limits",
}


class Subject(NamedTuple):
    """A run under its name."""

    name: str
    source: str
    """Where its estimates come from, in words."""
    run: Run
    config: Config
    train: str = ""
    """For which its distances are computed, in words."""


def chart_data(subject: Subject, target_kmh: float) -> dict[str, Any]:
    """Return what the script of the report draws; lengths in m, speeds in km/h, forces in kN, times in s."""
    run, config = subject.run, subject.config
    planned = distances(run, target_kmh * KMH, config.train)
    moments = _moments(run, config, planned)
    first = first_identified(run)
    place, speed = run.way
    kept = _thinned(place.t_ns.size, MOST_POINTS)
    return {
        "name": subject.name,
        "source": subject.source,
        "bands": [
            {"from": _round(band.start_s, 2), "to": _round(band.end_s, 2), "kind": band.regime.lower(), "label": label}
            for band in bands(run)
            if (label := IN_WORDS.get(band.regime))
        ],
        "charts": [_chart(run, chart) for chart in charts(run, target_kmh, config.train)],
        "path": _way(run, Curve(0, place.values[kept], speed.values[kept])),
        "moments": moments,
        "opens_at": moments[-1]["t"] if first is None else _round(run.seconds(run.speed.t_ns)[first], 2),
    }


def _moments(run: Run, config: Config, planned: Distances) -> list[dict[str, Any]]:
    """What is known at every estimate that has a place on the slider, with the braking curves from there."""
    safe, nominal = ({curve.t_ns: curve for curve in curves} for curves in (run.safe, run.nominal))
    regimes = run.regime.by_time()
    kept = _thinned(run.speed.t_ns.size, MOST_POINTS // 5)
    times = run.speed.t_ns[kept]
    columns = (run.speed.values[kept], run.position.values[kept], run.mu.at(times), run.mu_lower.at(times))
    moments = []
    for i, speed, place, mu, lower in zip(kept.tolist(), *(column.tolist() for column in columns), strict=True):
        t_ns = int(run.speed.t_ns[i])
        fixed = braking.curve(config.train, abs(speed), FIXED_MU)
        moments.append(
            {
                "t": _round(run.seconds(run.speed.t_ns)[i], 2),
                "speed": _round(speed / KMH, 2),
                "mu": _round(mu, 5),
                "mu_lower": _round(lower, 5),
                "regime": IN_WORDS.get(regimes.get(t_ns, ""), "regime not recorded"),
                "distance": _round(planned.identified[i], 1),
                "saved": _round(planned.saved[i], 1),
                "saved_at_least": _round(planned.saved_at_least[i], 1),
                "fixed": _way(run, Curve(t_ns, place + fixed.distance_m, fixed.speed_mps)),
                "safe": _way(run, safe[t_ns]) if t_ns in safe else None,
                "nominal": _way(run, nominal[t_ns]) if t_ns in nominal else None,
            }
        )
    return moments


def _way(run: Run, curve: Curve) -> dict[str, list[float | None]]:
    start_m = float(run.way[0].values[0])
    return {"x": _rounded(curve.position_m - start_m, 1), "y": _rounded(curve.speed_mps / KMH, 2)}


def _chart(run: Run, chart: Chart) -> dict[str, Any]:
    lines = []
    for label, kind, series in chart.lines:
        kept = _thinned(series.t_ns.size, MOST_POINTS)
        x, y = _rounded(run.seconds(series.t_ns[kept]), 3), _rounded(series.values[kept], chart.digits)
        lines.append({"label": label, "kind": kind, "dots": kind == "identified", "x": x, "y": y})
    return {"title": chart.title, "range": chart.range, "lines": lines}


def _thinned(size: int, most: int) -> Times:
    """Indices of about `most` of `size` values, evenly spread, with the first and the last."""
    return np.unique(np.linspace(0, size - 1, min(size, most)).round().astype(np.int64)) if size else np.arange(0)


def _rounded(values: ArrayLike, digits: int) -> list[float | None]:
    """Numbers for JSON; None, a gap in the chart, for what is not finite."""
    rounded: list[float] = np.round(np.asarray(values, dtype=np.float64), digits).tolist()
    return [number if math.isfinite(number) else None for number in rounded]


def _round(value: float, digits: int) -> float:
    return round(float(value), digits)

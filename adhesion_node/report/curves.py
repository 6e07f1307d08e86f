# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""A run as plain numbers for the charts of a page: series over time and the braking curves of every moment."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core import Config, Regime
from ..core.physics import braking
from ..core.physics.train import KMH, Array
from ..wire.codecs import ATMOSPHERE_PA
from .findings import distances, first_identified
from .run import FIXED_MU, Curve, Run, bands
from .series import Series, Times

MOST_POINTS = 1500
"""Points of a series at most: more than a screen is wide."""

IN_WORDS = {
    Regime.COASTING.name: "nothing to learn",
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


def chart_data(subject: Subject, target_kmh: float) -> dict[str, Any]:
    """Return what the script of the report draws; lengths in m, speeds in km/h, forces in kN, times in s."""
    run, config = subject.run, subject.config
    planned = distances(run, target_kmh * KMH, config.train)
    brake = config.train.brake_force(run.pressure.values - ATMOSPHERE_PA) / 1e3
    moments = _moments(run, config, planned.identified, planned.saved, planned.saved_at_least)
    first, seen = first_identified(run), run.learnt
    return {
        "name": subject.name,
        "source": subject.source,
        "confidence": "" if run.confidence is None else f", {run.confidence:.0%} confidence",
        "bands": [
            {"from": _round(band.start_s, 2), "to": _round(band.end_s, 2), "kind": band.regime.lower(), "label": label}
            for band in bands(run)
            if (label := IN_WORDS.get(band.regime))
        ],
        "true_mu": _over_time(run, run.true_mu.t_ns, run.true_mu.values, 5),
        "mu": _over_time(run, run.mu.t_ns, run.mu.values, 5),
        "mu_lower": _over_time(run, run.mu_lower.t_ns, run.mu_lower.values, 5),
        "true_speed": _over_time(run, run.true_speed.t_ns, run.true_speed.values / KMH, 2),
        "speed": _over_time(run, run.speed.t_ns, run.speed.values / KMH, 2),
        "brake": _over_time(run, run.pressure.t_ns, brake, 1),
        "true_force": _over_time(run, run.true_mu.t_ns, config.train.adhesion_force(run.true_mu.values) / 1e3, 1),
        "identified_force": _over_time(run, run.mu.t_ns, config.train.adhesion_force(run.mu.values) / 1e3, 1),
        "saved": _over_time(run, run.speed.t_ns[seen], planned.saved[seen], 1),
        "saved_at_least": _over_time(run, run.speed.t_ns[seen], planned.saved_at_least[seen], 1),
        "path": _path(run),
        "moments": moments,
        "opens_at": moments[-1]["t"] if first is None else _round(run.seconds(run.speed.t_ns)[first], 2),
    }


def _moments(run: Run, config: Config, distance: Array, saved: Array, least: Array) -> list[dict[str, Any]]:
    """What is known at every estimate that has a place on the slider, with the braking curves from there."""
    start_m = _start_m(run)
    safe, nominal = ({curve.t_ns: curve for curve in curves} for curves in (run.safe, run.nominal))
    regimes = dict(zip(run.regime.t_ns.tolist(), run.regime.values.tolist(), strict=True))
    kept = _thinned(run.speed.t_ns.size, MOST_POINTS // 5)
    times = run.speed.t_ns[kept]
    columns = (run.speed.values[kept], run.position.values[kept], run.mu.at(times), run.mu_lower.at(times))
    moments = []
    for i, speed, place, mu, lower in zip(kept.tolist(), *(column.tolist() for column in columns), strict=True):
        t_ns = int(run.speed.t_ns[i])
        fixed = braking.curve(config.train, speed, FIXED_MU)
        moments.append(
            {
                "t": _round(run.seconds(run.speed.t_ns)[i], 2),
                "speed": _round(speed / KMH, 2),
                "mu": _round(mu, 5),
                "mu_lower": _round(lower, 5),
                "regime": IN_WORDS.get(regimes.get(t_ns, ""), "regime not recorded"),
                "distance": _round(distance[i], 1),
                "saved": _round(saved[i], 1),
                "saved_at_least": _round(least[i], 1),
                "fixed": _way(Curve(t_ns, place + fixed.distance_m, fixed.speed_mps), start_m),
                "safe": _way(safe[t_ns], start_m) if t_ns in safe else None,
                "nominal": _way(nominal[t_ns], start_m) if t_ns in nominal else None,
            }
        )
    return moments


def _start_m(run: Run) -> float:
    place = run.true_position if run.true_position.t_ns.size else run.position
    return float(place.values[0])


def _path(run: Run) -> dict[str, list[float | None]]:
    """The way of the train: the true one where it is known."""
    known = run.true_position.t_ns.size > 0
    place, speed = (run.true_position, run.true_speed) if known else (run.position, run.speed)
    kept = _thinned(place.t_ns.size, MOST_POINTS)
    return _way(Curve(0, place.values[kept], speed.values[kept]), _start_m(run))


def _way(curve: Curve, start_m: float) -> dict[str, list[float | None]]:
    return {"x": _rounded(curve.position_m - start_m, 1), "y": _rounded(curve.speed_mps / KMH, 2)}


def _over_time(run: Run, t_ns: Times, values: Array, digits: int) -> dict[str, list[float | None]]:
    kept = _thinned(t_ns.size, MOST_POINTS)
    return {"t": _rounded(run.seconds(t_ns[kept]), 3), "v": _rounded(values[kept], digits)}


def _thinned(size: int, most: int) -> Times:
    """Indices of about `most` of `size` values, evenly spread, with the first and the last."""
    return np.unique(np.linspace(0, size - 1, min(size, most)).round().astype(np.int64)) if size else np.arange(0)


def _rounded(values: ArrayLike, digits: int) -> list[float | None]:
    """Numbers for JSON; None, a gap in the chart, for what is not finite."""
    rounded: list[float] = np.round(np.asarray(values, dtype=np.float64), digits).tolist()
    return [number if math.isfinite(number) else None for number in rounded]


def _round(value: float, digits: int) -> float:
    return round(float(value), digits)


def changes(series: Series) -> list[tuple[int, str]]:
    """Times and texts at which a series of texts changes, the first included; "" is left out."""
    texts = [str(text) for text in series.values]
    rows = zip(series.t_ns.tolist(), texts, ["", *texts[:-1]], strict=True)
    return [(t_ns, text) for t_ns, text, before in rows if text not in ("", before)]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A braking as one row, and what it showed of the rail by place: what many recordings are brought down to."""

from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...core import Prediction, Regime
from ...core.physics.train import KMH
from .rows import length_m

BRAKING = np.dtype(
    [
        *(("t_ns", np.int64), ("place_m", np.float64), ("place_end_m", np.float64)),
        *((name, np.float64) for name in ("from_kmh", "to_kmh", "duration_s", "distance_m", "deceleration_mps2")),
        *((name, np.float64) for name in ("mu", "mu_std", "mu_least", "used", "mu_lower")),
        *((name, np.float64) for name in ("share_adhesion", "share_brake", "share_unclaimed")),
        *((name, np.float64) for name in ("safe_m", "nominal_m")),
        ("estimates", np.int64),
    ]
)
"""Stamp of the first estimate; from which place and speed to which, and how long it took. `mu`, `mu_std`, `mu_least`:
median, its standard deviation and the least where it is claimed that adhesion limits, NaN without such a claim; `used`:
median of what the train used of the adhesion, whatever limited it. `mu_lower`: the least bound where adhesion limited,
else the highest that was shown. Shares of the regimes; what the curves to a standstill foresaw at the beginning."""

CELL = np.dtype(
    [
        *(("cell", np.int64), ("t_ns", np.int64), ("limited", np.bool_)),
        *((name, np.float64) for name in ("speed_mps", "mu", "mu_std", "used", "mu_lower")),
    ]
)
"""What a braking showed of a piece of track: its number, counted from 0 m; when and how fast; whether adhesion limited.
If not, `mu` is NaN: all that is known is that the train used `used`, and that there is `mu_lower` at least."""

SURE = 0.01
"""Standard deviation of mu above which a bound tells of the estimator rather than of the rail."""

LEAST_LOST_MPS = 3.0 * KMH
"""What slows down less is no braking of which anything could be told."""

GAP_NS = 10_000_000_000
"""Estimates further apart belong to two brakings."""

CELL_M = 100.0
"""Length of a piece of track."""


Item = TypeVar("Item")


class Braking(NamedTuple):
    """A row of `BRAKING`, and those of `CELL`."""

    row: NDArray[np.void]
    cells: NDArray[np.void]


def brakings(made: Iterable[Prediction], cell_m: float = CELL_M, sign: int = 1) -> Iterator[Braking]:
    """Yield the brakings among predictions as soon as they are over; nothing else is kept.

    `sign` is -1 where the chainage, by which places are told, falls along the run.
    """
    told = (one for one in made if one.estimate.window == 0 or not one.estimate.withheld)
    for braking in split(told, lambda one: one.estimate.window > 0, _stamp_and_speed):
        yield _told(braking, cell_m, sign)


def split(
    items: Iterable[Item], under_brake: Callable[[Item], bool], stamp_and_speed: Callable[[Item], tuple[int, float]]
) -> Iterator[list[Item]]:
    """Yield those of each braking, whatever tells of the train and its brake, as soon as it is over."""
    braking: list[Item] = []
    for item in chain(items, [None]):
        if braking and (
            item is None or not under_brake(item) or stamp_and_speed(item)[0] - stamp_and_speed(braking[-1])[0] > GAP_NS
        ):
            (_, first_mps), (_, last_mps) = (stamp_and_speed(braking[at]) for at in (0, -1))
            if abs(first_mps) - abs(last_mps) >= LEAST_LOST_MPS:
                yield braking
            braking = []
        if item is not None and under_brake(item):
            braking.append(item)


def _stamp_and_speed(made: Prediction) -> tuple[int, float]:
    return made.estimate.t_ns, made.estimate.speed_mps


def _told(braking: list[Prediction], cell_m: float, sign: int) -> Braking:
    """What the predictions of a braking showed."""
    estimates = [made.estimate for made in braking]
    t_ns = np.array([e.t_ns for e in estimates])
    place, speed, mu, std, lower = np.array(
        [(sign * e.position_m, abs(e.speed_mps), e.mu, e.mu_std, e.mu_lower) for e in estimates]
    ).T
    adhesion, brake = (
        np.array([e.regime is regime for e in estimates]) for regime in (Regime.ADHESION_LIMITED, Regime.BRAKE_LIMITED)
    )
    shown, claimed = std <= SURE, adhesion
    adhesion = adhesion & shown if (adhesion & shown).any() else adhesion
    seconds = 1e-9 * float(t_ns[-1] - t_ns[0])
    found = (np.median(mu[adhesion]), np.median(std[adhesion]), mu[adhesion].min()) if adhesion.any() else (np.nan,) * 3
    values: dict[str, Any] = {
        "t_ns": t_ns[0],
        "place_m": place[0],
        "place_end_m": place[-1],
        "from_kmh": speed[0] / KMH,
        "to_kmh": speed[-1] / KMH,
        "duration_s": seconds,
        "distance_m": abs(place[-1] - place[0]),
        "deceleration_mps2": (speed[0] - speed[-1]) / seconds,
        **dict(zip(("mu", "mu_std", "mu_least"), found, strict=True)),
        "used": np.median(mu[shown]) if shown.any() else np.nan,
        "mu_lower": _bound(lower, adhesion, shown),
        "share_adhesion": claimed.mean(),
        "share_brake": brake.mean(),
        "share_unclaimed": (~claimed & ~brake).mean(),
        "safe_m": length_m(braking[0].safe),
        "nominal_m": length_m(braking[0].nominal),
        "estimates": len(braking),
    }
    row = np.array([tuple(np.nan if values[name] is None else values[name] for name in BRAKING.names or ())], BRAKING)
    cell = np.floor(place / cell_m).astype(np.int64)
    cells = [
        (
            *(number, t_ns[here][0], adhesion[here].any(), speed[here].mean()),
            *(_mean(mu, adhesion & here), _mean(std, adhesion & here), _mean(mu, here)),
            _bound(lower, adhesion & here, here),
        )
        for number in np.unique(cell[shown])
        for here in ((cell == number) & shown,)
    ]
    return Braking(row, np.array(cells, CELL))


def _mean(values: NDArray[np.float64], which: NDArray[np.bool_]) -> float:
    """Mean of those; NaN without any. Of standard deviations too: estimates so close err together."""
    return float(values[which].mean()) if which.any() else float("nan")


def _bound(lower: NDArray[np.float64], adhesion: NDArray[np.bool_], shown: NDArray[np.bool_]) -> float:
    """The least bound where adhesion limited, else the highest that was shown."""
    if adhesion.any():
        return float(lower[adhesion].min())
    return float(lower[shown].max()) if shown.any() else float("nan")

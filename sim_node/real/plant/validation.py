# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a run shows of the plant, in the figures that are published of trains."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .creep import CREEPING_MPS, SLIDING
from .journey import PERIOD_S, Array, Journey

BAND = 0.04, 0.20
"""Creep in which protection holds sliding wheels."""

SLOWEST_MPS = 5.0
"""Judged above this speed: below it the thresholds of the protection are no share of the speed."""

REMEMBERED_S = 3.0
"""A group that slid so short a time ago counts as sliding: protection lets it roll in every cycle."""

DUMPED = 0.05
"""Share of its pressure that a cylinder loses within a period when it is dumped."""


class Figures(NamedTuple):
    """One run from the demand of the full brake, NaN where nothing slides."""

    stop_m: float
    deceleration_mps2: float
    """Mean over the way."""
    used: float
    """Mean once the brake is full."""
    available: float
    sliding: float
    """Mean share of the groups that slide or did so within `REMEMBERED_S`."""
    efficiency: float
    """Used over available while at least half of the groups so slide."""
    creep: float
    """Median of groups beyond `creep.SLIDING`."""
    within: float
    """Share of these within `BAND`."""
    highest: float
    """Their 95 % quantile."""
    cycles_hz: float
    """Dumps of one group in a second in which it so slides."""


def creep(journey: Journey) -> Array:
    """Return the creep of the groups, shape (T, A)."""
    speed = journey.speed_mps[:, None]
    return np.asarray((speed - journey.wheel_radps * journey.radius_m) / np.maximum(speed, CREEPING_MPS))


def slid(journey: Journey) -> NDArray[np.bool_]:
    """Return which groups slid at some time within the last `REMEMBERED_S`, shape (T, A).

    A group slides from `SLIDING` of creep on: on a dry rail beyond the peak of its curve, on others about there.
    """
    count = np.cumsum(creep(journey) > SLIDING, axis=0)
    periods = round(REMEMBERED_S / PERIOD_S)
    before = np.concatenate([np.zeros_like(count[:periods]), count[:-periods]])
    return np.asarray(count > before[: len(count)])


def figures(journey: Journey, full_s: float) -> Figures:
    """Judge a run; `full_s` is the time in which the full brake builds up."""
    begin = int(np.searchsorted(journey.time_s, journey.full_from_s))
    stop = float(journey.position_m[-1] - journey.position_m[begin])
    judged = (journey.time_s > journey.full_from_s + full_s) & (journey.speed_mps > SLOWEST_MPS)
    creeps = creep(journey)
    slides = slid(journey)[judged]
    used, available, creeps = journey.used[judged], journey.available[judged], creeps[judged]
    pressure = journey.cylinder_pa[judged]
    dumps = np.diff(pressure, axis=0) < -DUMPED * pressure[:-1]
    starts = int((dumps[1:] & ~dumps[:-1]).sum())
    beyond = creeps[creeps > SLIDING]
    mostly = slides.mean(axis=1) >= 0.5
    nothing = not beyond.size
    return Figures(
        stop,
        float(journey.speed_mps[begin] ** 2 / (2.0 * stop)),
        float(used.mean()),
        float(available.mean()),
        float(slides.mean()),
        float(used[mostly].sum() / available[mostly].sum()) if mostly.any() else np.nan,
        np.nan if nothing else float(np.median(beyond)),
        np.nan if nothing else float(np.mean((beyond > BAND[0]) & (beyond < BAND[1]))),
        np.nan if nothing else float(np.quantile(beyond, 0.95)),
        starts / (slides.sum() * PERIOD_S) if slides.any() else np.nan,
    )

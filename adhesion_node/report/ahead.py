# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The supervision limits ahead of a train, from its safe braking curve and what the ATP monitor said at one place.

The monitor tells its limits at the present place only. Between there and the target they follow from the braking
curve, if its times and margins are the nominal ones: that is checked against what it said, else nothing is drawn.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..core.atp.config import SupervisionConfig
from ..core.atp.limits import Limits, distances, speeds
from ..core.physics.braking import BrakingCurve
from ..core.physics.train import KMH, Array

SHOWN = ("permitted", "warning", "sbi", "ebi")
"""Limits over the way, from the lowest speed to the highest."""

TOLD = (
    *("target_position_m", "target_speed_mps", "distance_to_target_m", "margin_m", "supervised_mps"),
    *(f"{name}_mps" for name in SHOWN),
)
"""Numbers of a status by which they are found."""

PLACES = 24
BEYOND_M = 200.0
"""Places at which they are told, and how far beyond the target."""

SAME_MPS = 0.3
"""The monitor's limits at the present place are met so well, else it has other settings; they are told to 1 mm/s."""


class Ahead(NamedTuple):
    """Speeds, m/s, of the limits over the way, m along the track; arrays of (`PLACES`,)."""

    position_m: Array
    permitted_mps: Array
    warning_mps: Array
    sbi_mps: Array
    ebi_mps: Array
    to_indication_s: float
    """Until the indication at the present speed; negative after it."""


def ahead(curve: BrakingCurve, said: Mapping[str, float]) -> Ahead | None:
    """Return the limits from the place of a judgement to the target; `said` are the numbers of that status by key.

    None where the status tells no limits, or others than this curve gives with nominal times.
    """
    try:
        target_m, target_mps = said["target_position_m"], said["target_speed_mps"]
        left_m, margin_m, supervised = said["distance_to_target_m"], said["margin_m"], said["supervised_mps"]
        here = np.array([said[f"{name}_mps"] for name in SHOWN])
    except KeyError:
        return None
    if left_m <= 0.0 or not 0.0 <= target_mps <= 500.0 * KMH or not 0.0 <= supervised <= 500.0 * KMH:
        return None
    config = SupervisionConfig(target_speed_kmh=target_mps / KMH, line_speed_kmh=500.0)
    fastest = np.array([supervised])
    safe_m = margin_m + distances(config, curve, fastest).ebi  # from the foremost place that the train may have
    reached = _rows(speeds(config, curve, safe_m))[:, 0]
    if here[0] < reached[0] - SAME_MPS:  # the line's own speed is lower
        config = replace(config, line_speed_kmh=max(float(here[0]), target_mps) / KMH)
        reached = _rows(speeds(config, curve, safe_m))[:, 0]
    if np.abs(reached - here).max() > SAME_MPS:
        return None
    way = np.linspace(0.0, left_m + BEYOND_M, PLACES)
    indicated_m = safe_m - distances(config, curve, fastest).indication
    permitted, warning, sbi, ebi = _rows(speeds(config, curve, safe_m - way))
    to_indication_s = float(indicated_m[0]) / max(supervised, 0.1)
    return Ahead(target_m - left_m + way, permitted, warning, sbi, ebi, to_indication_s)


def _rows(limits: Limits) -> Array:
    return np.array([limits.permitted, limits.warning, limits.sbi, limits.ebi])

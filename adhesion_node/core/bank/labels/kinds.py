# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What may limit the motion, and how smooth the rail may be."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...physics.train import Array

if TYPE_CHECKING:
    from ...config import Config


class Kind(NamedTuple):
    """What limits the motion, and how steady it is."""

    name: str
    slides: bool
    """Whether the adhesion limits."""
    drift: float
    """Of the adhesion at one speed, relative standard deviation over 1 s."""
    roughness: float
    """Of the rail over `ROUGHNESS_M`, relative standard deviation, in the mean over the length of a train."""
    restlessness_mps: float
    """Standard deviation that unknown decelerations give the speed over 1 s."""
    prior: float
    """Probability when a braking begins."""
    growth: float = 0.0
    """Of the adhesion at one speed, in 1 s, relative."""
    free_s: float = 0.0
    """How long a net deceleration lasts that no brake holds; 0: brake or rail hold it."""
    swings: bool = False
    """Whether what is used swings within `SWING_S`, as slide protection works in turns; else the rail is rough."""


KINDS = (
    Kind("free", False, 0.0, 0.0, 0.02, 0.5, free_s=5.0),
    Kind("brake", False, 0.0, 0.0, 0.03, 0.55),
    Kind("smooth", True, 0.001, 0.0, 0.018, 0.2),
    Kind("swinging", True, 0.001, 0.0, 0.01, 0.12, swings=True),
    Kind("even", True, 0.006, 0.0, 0.01, 0.12, swings=True),
    Kind("rough", True, 0.005, 0.05, 0.03, 0.1),
    Kind("drying", True, 0.02, 0.05, 0.05, 0.04, 0.025),
    Kind("passing", True, 0.3, 0.0, 0.05, 0.01),
    Kind("failing", True, 0.006, 0.0, 0.01, 0.08, -0.006, swings=True),
    Kind("steady", False, 0.0, 0.0, 0.02, 0.5, free_s=7200.0),
    Kind("other", False, 0.0, 0.0, 0.02, 0.02, free_s=800.0),
)
FREE, HELD, PASSING, STEADY, OTHER = 0, 1, 7, 9, 10
SLIDING = tuple(index for index, kind in enumerate(KINDS) if kind.slides)

SLIDES = np.array([kind.slides for kind in KINDS])
DRIFT = np.array([kind.drift for kind in KINDS])
ROUGHNESS = np.array([kind.roughness for kind in KINDS])
GROWTH = np.array([kind.growth for kind in KINDS])
FREE_S = np.array([kind.free_s for kind in KINDS])
SWINGS = np.array([kind.swings for kind in KINDS])
RESTLESSNESS = np.array([kind.restlessness_mps for kind in KINDS])

ROUGHNESS_M, GRADE_M, RESIDUAL_M = 100.0, 4000.0, 1500.0
"""Correlation lengths of the roughness, of a grade that no profile tells, as a slope may be long, and of what a profile
leaves open of it; on the way ahead the last one counts for either, as a slope may end."""

SWING_S = 0.7
"""Correlation time of a swing."""

# how fast roughness or swing of each kind fades, per m and per s, shape (K, 2)
FADING = np.array([(0.0, 1.0 / SWING_S) if kind.swings else (1.0 / ROUGHNESS_M, 0.0) for kind in KINDS])

FREE_STD = 0.06
"""Net deceleration over g of a train that no brake holds: traction is unknown."""


def roughness_of(config: Config) -> Array:
    """Relative standard deviation of the roughness, or of the swing, of each kind, shape (K,)."""
    return np.where(SWINGS, config.ripple, ROUGHNESS)


def grade_m_of(config: Config) -> float:
    """Correlation length of the grade that is not known, m."""
    return RESIDUAL_M if config.track.sections else GRADE_M

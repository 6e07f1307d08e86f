# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How adhesion may depend on speed: as the law of the settings says, a part as much, or not at all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...physics.adhesion import SpeedLaw
from ...physics.train import Array
from ...setting import once

if TYPE_CHECKING:
    from ...config import Config

PART, PART_AT_MPS = 1 / 3, 30.0
"""Part of the law's dependence on speed that another law has, as slide protection levels out what it uses, and the
speed at which it meets that."""

SLIPPERY, WET = 0.04, 0.07
"""Adhesion up to which a rail counts as covered by a film, as of leaves, and from which on as wet; between, as both."""

FLAT_SLIPPERY, FLAT_WET = 0.9, 0.45
"""Of what is not the law itself, the share that does not depend on speed at all: what a film gives hardly does."""

LEVELS = np.array([SLIPPERY, WET])


def laws_of(config: Config) -> tuple[tuple[SpeedLaw, tuple[float, float]], ...]:
    """Each law with its probability on a slippery and on a wet rail; a film has that of a clean rail less likely."""
    law, known = config.speed_law, np.array([config.law_probability**2, config.law_probability])
    level = (1.0 / PART - 1.0) * float(law(np.asarray(PART_AT_MPS))) / law.scale
    part = SpeedLaw(law.floor + level, law.gain_kmh, law.offset_kmh)
    flat = np.array([FLAT_SLIPPERY, FLAT_WET])
    shares = known, (1.0 - known) * (1.0 - flat), (1.0 - known) * flat
    return tuple(
        (each, (float(slippery), float(wet)))
        for each, (slippery, wet) in zip((law, part, SpeedLaw(1.0)), shares, strict=True)
    )


@once
def law_priors(config: Config) -> Array:
    """Their probabilities, shape (L, 2)."""
    return np.array([priors for _, priors in laws_of(config)])

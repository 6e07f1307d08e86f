# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How measured positions err, as a hypothesis says it: white, slowly, or both."""

from typing import NamedTuple

import numpy as np


class Noise(NamedTuple):
    """How measured positions err: a white part and a slow one, by the standard deviation that they declare."""

    white: float
    """White part over the declared one."""
    least_white_m: float
    slow: float
    """Slow part over the declared one."""
    least_slow_m: float
    lasts_s: float
    """Correlation time of the slow part."""
    prior: float

    def stds_m(self, declared_m: float) -> tuple[float, float]:
        """Standard deviations of the white and the slow part, m, where so much is declared."""
        return max(self.white * declared_m, self.least_white_m), max(self.slow * declared_m, self.least_slow_m)


NOISES = (
    Noise(1.0, 0.0, 0.0, 0.0, 1.0, 0.4),
    Noise(0.03, 0.05, 1.0, 1.0, 30.0, 0.2),
    Noise(0.03, 0.05, 1.0, 1.0, 200.0, 0.05),
    Noise(0.03, 0.05, 1.0, 1.0, 2000.0, 0.05),
    Noise(0.05, 0.05, 1.0, 1.0, 2000.0, 0.03),
    Noise(1.0, 0.0, 1.0, 2.0, 30.0, 0.2),
    Noise(0.25, 0.1, 1.0, 2.0, 30.0, 0.1),
    Noise(0.0, 0.05, 0.0, 1.0, 30.0, 0.02),
    Noise(0.0, 0.1, 0.0, 1.0, 30.0, 0.02),
    Noise(0.0, 0.1, 0.0, 2.0, 30.0, 0.02),
)
"""The last ones are satellites' own, whatever is declared: of a receiver that wanders by half of what it declares, or
by ten times as much, the hypothesis nearest would else be one that hardly wanders, and takes the rest for the train."""

RECEIVER = 1
"""Index of what satellites may always do, by what they declare."""

TWINS = 1.7, 1.45
"""Where the white and the slow part of satellites are within these factors of another's they are the same: two such
hypotheses leave the rail half of the room."""

LASTS = np.array([noise.lasts_s for noise in NOISES])
WHITE = np.array([(noise.white, noise.least_white_m) for noise in NOISES])
SLOW = np.array([(noise.slow, noise.least_slow_m) for noise in NOISES])


def of_receiver(declared_m: float) -> list[int]:
    """Indices of how a receiver may err that declares so much, m."""
    by_declared = NOISES[RECEIVER].stds_m(declared_m)

    def is_twin(noise: Noise) -> bool:
        pairs = zip(TWINS, noise.stds_m(declared_m), by_declared, strict=True)
        return not noise.white and all(1.0 / factor < own / std < factor for factor, own, std in pairs)

    return [index for index, noise in enumerate(NOISES) if not is_twin(noise)]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How far above an allowed speed the train is warned and braked: the ceiling limits of SUBSET-026-3, 3.13.9.2."""

from typing import NamedTuple

from ..physics.train import KMH


class Excess(NamedTuple):
    """Speed above the allowed one, km/h: `least` up to `from_kmh`, rising linearly to `most` at `to_kmh` and beyond.

    >>> [round(EBI.above(speed * KMH) / KMH, 6) for speed in (50, 110, 160, 210, 350)]
    [7.5, 7.5, 11.25, 15.0, 15.0]
    """

    least_kmh: float
    most_kmh: float
    from_kmh: float
    to_kmh: float

    def above(self, speed_mps: float) -> float:
        """Excess, m/s, above an allowed speed in m/s; 0 above 0, where the train must stand."""
        if speed_mps <= 0.0:
            return 0.0
        share = (speed_mps / KMH - self.from_kmh) / (self.to_kmh - self.from_kmh)
        return (self.least_kmh + min(max(share, 0.0), 1.0) * (self.most_kmh - self.least_kmh)) * KMH


# Fixed values of appendix A.3.1.
WARNING = Excess(4.0, 5.0, 110.0, 140.0)
SBI = Excess(5.5, 10.0, 110.0, 210.0)
EBI = Excess(7.5, 15.0, 110.0, 210.0)

NONE = Excess(0.0, 0.0, 0.0, 1.0)
"""Of the permitted speed and the indication."""

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""An accelerometer that lies: a braking shows that it is turned round, or dead, and positions that it is askew."""

from __future__ import annotations

import math
from typing import NamedTuple

FORWARD_MPS2, BACKWARD_MPS2, MEAN_S, MEAN_SIGMA = 0.2, 0.1, 1.0, 3.0
"""What an accelerometer feels under the brake in the mean over such a time, beyond its noise, once it is turned round,
and once it is seen not to be."""

STILL_S, LEAST_STILL_S, WATCHED_S, STILLER = 2.0, 0.3, 5.0, 3.0
"""No accelerometer shows the same to the bit for so long under the brake. One that was watched for so long before the
brake, and whose noise made it differ, does not for more than this, and so many times what it did then."""

ASKEW_MPS2, ASKEW_SIGMA = 0.7, 3.0
"""What an accelerometer that was mounted by eye shows too much at most, 4 degrees, and standard deviations by which it
surely shows more: its gravity is on the wrong axis, or in another unit."""


class Pointing(NamedTuple):
    """Where an accelerometer points, by what it feels under the brake in the mean of the last second."""

    mean_mps2: float = 0.0
    """Forward positive, without its bias."""
    forward: bool | None = None
    """Whether it points forward as it should, and shows anything; None: no braking has shown it yet."""
    shown_mps2: float = math.nan
    """What it showed last, ..."""
    still_s: float = 0.0
    """... for how long under the brake it has shown nothing else, ..."""
    rested_s: float = 0.0
    """... and for how long without; ..."""
    longest_s: float = 0.0
    """... that at its longest, ..."""
    watched_s: float = 0.0
    """... of so long a time."""
    bias_mps2: float = 0.0
    """What it is known to show too much, from before the brake."""
    askew: bool = False
    """Whether that is, or was, too much for one that points along the track."""

    @property
    def lies(self) -> bool:
        """Whether it is to be left out."""
        return self.askew or self.forward is False

    def biased(self, bias_mps2: float, std_mps2: float) -> Pointing:
        """Note what it is known to show too much by now."""
        return self._replace(askew=self.askew or abs(bias_mps2) - ASKEW_SIGMA * std_mps2 > ASKEW_MPS2)

    def resting(self, shown_mps2: float, elapsed_s: float, bias_mps2: float) -> Pointing:
        """Note what it shows while no brake is applied, and how much of that is too much."""
        rested_s = self.rested_s + elapsed_s if shown_mps2 == self.shown_mps2 else 0.0
        longest_s, watched_s = max(self.longest_s, rested_s), self.watched_s + elapsed_s
        before = self.mean_mps2, self.forward
        return Pointing(*before, shown_mps2, 0.0, rested_s, longest_s, watched_s, bias_mps2, self.askew)

    @property
    def repeats(self) -> bool:
        """Whether it shows the same for longer than it is used to."""
        return self.still_s > min(STILLER * self.longest_s if self.watched_s > WATCHED_S else STILL_S, STILL_S)

    @property
    def is_still(self) -> bool:
        """Whether it does for too long."""
        return self.repeats and self.still_s > LEAST_STILL_S

    def after(self, shown_mps2: float, felt_mps2: float, variance: float, elapsed_s: float) -> Pointing:
        """Note what it shows under the brake, and the mean of that since the time before, of such a variance."""
        still_s = self.still_s + elapsed_s if shown_mps2 == self.shown_mps2 else 0.0
        shown = self._replace(shown_mps2=shown_mps2, still_s=still_s)
        if shown.is_still:
            return shown._replace(forward=False)
        part = -math.expm1(-elapsed_s / MEAN_S)
        mean = self.mean_mps2 + part * (felt_mps2 - self.bias_mps2 - self.mean_mps2)
        noise = MEAN_SIGMA * math.sqrt(0.5 * part * variance)
        forward = False if mean > FORWARD_MPS2 + noise else True if mean < -BACKWARD_MPS2 - noise else self.forward
        return shown._replace(mean_mps2=mean, forward=forward)

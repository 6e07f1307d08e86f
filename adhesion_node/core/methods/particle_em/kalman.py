# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Extended Kalman filter of a window at a given adhesion, and what the measurements tell of that adhesion."""

from __future__ import annotations

from typing import NamedTuple

from ...belief.gaussian import Gaussian
from ...physics.train import Array
from ..kernels import expecting, filtering


class Filtered(NamedTuple):
    """The filter's pass through a window of K steps."""

    mean: Array
    """Of (s, v) after each measurement, (K, 2)."""
    covariance: Array
    """(K, 2, 2)."""
    sensitivity: Array
    """Derivative of the last mean with respect to mu, (2,)."""
    information: float
    """Observed information on mu that the measurements hold, the prior's state being uncertain too."""

    def belief(self, index: int) -> Gaussian:
        """Filtered belief of (s, v) after the measurement of that index."""
        return Gaussian(self.mean[index].copy(), self.covariance[index].copy())


def filtered_by(known: filtering.Given, mu: float) -> Filtered:
    """Filter a window, put as the compiled loops need it, at an adhesion."""
    return Filtered(*expecting.tracked(known, float(mu)))

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The parabola through positions."""

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

Array = NDArray[np.float64]


@kernel
def curvature(time: Array, places: Array) -> float:
    """Coefficient of t^2, by the polynomial that is orthogonal to 1 and t."""
    middle, count = time.mean(), time.size
    square, cube = 0.0, 0.0
    for t in time:
        square += (t - middle) ** 2
        cube += (t - middle) ** 3
    along, whole = 0.0, 0.0
    for k in range(count):
        t = time[k] - middle
        bend = t * t - cube / square * t - square / count
        along += bend * places[k]
        whole += bend * bend
    return along / whole

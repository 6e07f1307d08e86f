# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

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

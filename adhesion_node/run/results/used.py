# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The adhesion that a train in truth uses, as estimates are held against it: slide protection swings it."""

import numpy as np
from numpy.typing import NDArray

from ...core.physics.train import Array

USED_S = 1.0
"""Time, centred, over which it is averaged."""


def averaged(t_ns: NDArray[np.int64], values: Array) -> Array:
    """Mean over `USED_S` centred at every time, over what there is of it at the ends and beside gaps; shape (T,).

    >>> averaged(np.array([0, 4, 8, 12]) * 10**8, np.array([1.0, 2.0, 6.0, 7.0])).tolist()
    [1.5, 3.0, 5.0, 6.5]
    """
    half_ns = round(USED_S / 2 * 1e9)
    total = np.concatenate(([0.0], np.cumsum(values)))
    first, last = np.searchsorted(t_ns, t_ns - half_ns), np.searchsorted(t_ns, t_ns + half_ns, side="right")
    return np.asarray((total[last] - total[first]) / (last - first))

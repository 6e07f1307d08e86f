# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The adhesion that maximises what EM expects."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

Array = NDArray[np.float64]


@kernel
def maximised(found: Array, lowest: float) -> tuple[float, float]:
    """Adhesion of at least `lowest` that maximises Q, of `expecting.reduced`, exact, also at kinks; the largest limit.

    Between two neighbouring limits Q is a parabola; beyond the largest limit it is flat, so the answer never
    exceeds that limit: "at least this much adhesion".
    """
    order = np.argsort(found[2])
    weights, weighted, squares, kept = 0.0, 0.0, 0.0, 0.0
    for k in range(found.shape[1]):
        weights += found[1, k]
        weighted += found[1, k] * found[0, k]
        squares += found[1, k] * found[0, k] ** 2
    best, mu, least = np.inf, lowest, lowest
    for k in order:  # with the lower limits below mu, the further steps are active and the others keep their limit
        used, weight, limit = found[0, k], found[1, k], max(found[2, k], lowest)
        tried = min(max(weighted / weights, least), limit)
        loss = kept + squares - tried * (2.0 * weighted - tried * weights)
        if loss < best:
            best, mu = loss, tried
        kept, least = kept + weight * (limit - used) ** 2, limit
        weights, weighted, squares = weights - weight, weighted - weight * used, squares - weight * used**2
    return mu, found[2, order[-1]]

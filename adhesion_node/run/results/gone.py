# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A value that is 0 for moments only, and the same before and behind: the 0 stands for none, and was not measured."""

import numpy as np

from ...core.physics.train import Array

LEAST_TIMES, LONGEST_S = 3, 2.5
"""So often a value is gone, and for no longer: a brake is released, and cylinders are vented, for longer."""

SAME = 0.05
"""By so much of it values differ before and behind: what slide protection vents comes back little by little."""

LEAST_PA, LEAST_RADPS = 5e4, 10.0
"""Of less nothing is said: a brake that begins or ends, and wheels that stop."""


def gone(t_s: Array, values: Array, least: float, mark: float = 0.0) -> int:
    """Return in how many rows values, shape (n,), are the mark for a moment among others by `least` off; 0: seldom.

    >>> t_s = np.arange(12.0)
    >>> gone(t_s, np.tile([3e5, 3e5, 0.0], 4), LEAST_PA), gone(t_s, np.repeat([3e5, 0.0, 3e5, 0.0], 3), LEAST_PA)
    (3, 0)
    """
    known = np.isfinite(values)
    t_s, values = t_s[known], values[known]
    edges = np.diff((values == mark).astype(np.int8), prepend=0, append=0)
    first, behind = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    inside = (first > 0) & (behind < len(values))
    first, behind = first[inside], behind[inside]
    a, b = values[first - 1] - mark, values[behind] - mark
    is_same = np.abs(a - b) < SAME * np.maximum(np.abs(a), np.abs(b))
    brief = is_same & (np.abs(a) > least) & (t_s[behind] - t_s[first - 1] < LONGEST_S)
    return int((behind - first)[brief].sum()) if brief.sum() >= LEAST_TIMES else 0

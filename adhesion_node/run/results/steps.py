# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The step in which values come, tens of metres or 5 km/h: none of them is known better."""

import numpy as np

from ...core.physics.train import Array

LEAST_VALUES = 10
"""Fewer are multiples of something by chance."""


def step_of(values: Array, least: float) -> float:
    """Return the step of which all changes are multiples, but for 5 % of `least`; 0 for less than that, or none.

    >>> speeds = np.array([0, 5, 5, 10, 15, 20, 25, 30, 35, 40, 45, 55]) / 3.6
    >>> round(step_of(speeds, 0.25), 4), step_of(speeds + 0.1 * np.arange(12) ** 2, 0.25)
    (1.3889, 0.0)
    """
    known, tolerance = values[np.isfinite(values)], 0.05 * least
    moved, distinct = np.abs(np.diff(known)), np.unique(known)
    if len(distinct) < LEAST_VALUES or np.ptp(moved) < least:  # a constant speed moves by equal ways, however fine
        return 0.0
    step, gaps = 0.0, np.diff(distinct)
    gaps = gaps[gaps > 1e-6 * least]  # what the conversion of units leaves
    for gap in gaps.tolist():
        rest = gap
        while rest > tolerance:  # Euclid, of numbers that are not exact
            step, rest = rest, abs(step - rest * round(step / rest))
        if step < least:
            return 0.0
    return step if (np.abs(gaps - step * np.round(gaps / step)) < tolerance).all() else 0.0

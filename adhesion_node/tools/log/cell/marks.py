# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Numbers that devices write where they know nothing, in the unit of the log: all nines, and the ends of integers."""

import numpy as np

from ....core.physics.train import Array
from .numbers import Flags

_NINES = [*(-(10.0**digits - 1.0) for digits in range(3, 8)), *(10.0**digits - 1.0 for digits in range(4, 8))]

_ENDS = [end for bits in (16, 32) for end in (-(2.0 ** (bits - 1)), 2.0 ** (bits - 1) - 1.0, 2.0**bits - 1.0)]

_STEPS = 1.0, 0.1, 0.01
"""What one of an integer may stand for: 655.35 km/h are 65535 hundredths."""

MARKS = np.array([*_NINES, *(end * step for end in _ENDS for step in _STEPS)])


def marks(written: Array) -> Flags:
    """Return which of the numbers, as they are written in the log, stand for no value.

    >>> marks(np.array([-9999.0, 65535.0, 655.35, 327.67, 50.0])).tolist()
    [True, True, True, True, False]
    """
    with np.errstate(over="ignore"):  # 1e308 is none of them
        return np.isin(np.round(written, 6), np.round(MARKS, 6))

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is doubtful of the columns of a frame, each with the remedy."""

import math
import re
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from ...core.physics.train import Array
from .gone import LEAST_PA, LEAST_RADPS, gone
from .steps import step_of

AXLE = re.compile(r"wheel_speed_[1-9]\d*")

TOO_COARSE = 2.0
"""Times the standard deviation: less is made good by what the estimator sees of the steps."""

ABSOLUTE_PA = 80e3, 108e3
"""A least pressure within is the air's: no brake stays applied by as much all along."""


def doubts(t_ns: NDArray[np.int64], columns: Mapping[str, Array], std_m: float) -> Iterator[str]:
    """Say where a 0 stands for no value, a pressure is absolute, or positions are coarser than `std_m` lets them be."""
    for name, values in columns.items():
        least = LEAST_PA if name in ("brake_pressure", "brake_demand") else LEAST_RADPS
        if (least == LEAST_PA or AXLE.fullmatch(name)) and (rows := gone(t_ns / 1e9, values, least)):
            yield f"frame column {name!r} is 0 in {rows} rows between others of the same value: no value? Make them NaN"
    for name in ("brake_pressure", "brake_demand"):
        least_pa = np.fmin.reduce(columns.get(name, [math.nan]))
        if ABSOLUTE_PA[0] < least_pa < ABSOLUTE_PA[1]:
            yield f"{name} never falls below {least_pa:.6g} Pa: is it absolute? Take the pressure of the air off"
    if "position" in columns and "variance" not in columns:
        step_m = step_of(columns["position"], TOO_COARSE * math.sqrt(12.0) * std_m)
        if step_m:
            least_m = step_m / math.sqrt(12.0)
            yield f"positions come in steps of {step_m:.4g} m, std_m = {std_m:g}: give {least_m:.3g} or more"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The creep curve of the creep estimator's diagnostics, He et al. 2017, (4) and (5)."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.creep.curve import adhesion
from ..core.intake.outcome import text_of
from .fit import number, numbers, rounded

CREEP_END, POINTS = 0.3, 40
"""Creep up to which the curve is drawn, and its points."""


def creep_part(values: Mapping[str, str], message: str) -> dict[str, Any] | None:
    """Return the curve through its peak, withheld or not; None where the diagnostics tell none."""
    known = numbers(values)
    if not {"p1", "p2", "mu_max", "lambda_m"} <= known.keys():
        return None
    theta = np.array([known["p1"], known["p2"]])
    slope = known["mu_max"] * (theta[0] + 2.0 * math.sqrt(max(theta[1], 0.0)))  # (5) solved
    creeps = np.linspace(0.0, CREEP_END, POINTS)
    return {
        "withheld": values.get("withheld") != "false",
        "why": text_of(message.removeprefix("withheld: ")),
        "peak": [number(known["lambda_m"], 4), number(known["mu_max"], 4)],
        "lower": number(known.get("mu_max_lower"), 4),
        "upper": number(known.get("mu_max_upper"), 4),
        "x": rounded(creeps, 4),
        "y": rounded(adhesion(creeps, slope, theta), 4),
    }

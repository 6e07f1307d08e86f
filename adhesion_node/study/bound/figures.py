# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The bound over the speed lost under the brake, by noise of the positions."""

from collections.abc import Mapping

import numpy as np

from ...core.physics.train import KMH, Array
from ..trial.drawing import draw_lines, picture
from ..trial.figures import Figures
from .nominal import Case, Nominal

LOST_KMH = np.linspace(5.0, 150.0, 300)


def draw(found: Mapping[Case, Nominal], figures: Figures) -> None:
    """Draw a picture for each scenario: bound_SCENARIO."""
    for scenario in dict.fromkeys(case.scenario for case in found):
        curves: dict[str, Array] = {}
        for case, (bound, _) in found.items():
            braked = bound.lost_mps > 0.0
            std = np.interp(LOST_KMH * KMH, bound.lost_mps[braked], 100.0 * bound.mu_relative_std[braked])
            curves |= {f"positions with σ = {case.sigma_m:g} m": std} if case.scenario == scenario else {}
        title = f"What no estimator can beat: {scenario.replace('_', ' ')}, positions at 10 Hz"
        with picture(figures.place(f"bound_{scenario}"), title) as axis:
            draw_lines(axis, LOST_KMH, curves)
            axis.set(xlabel="speed lost under the brake, km/h", ylabel="least σ of μ̂, %", yscale="log")
            axis.legend(loc="upper right")

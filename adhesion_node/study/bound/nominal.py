# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The bound along a noise-free run of a scenario, at the nominal noise."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_node.train.plant import ADHESION_LIMITED, NO_NOISE, simulate
from sim_node.train.scenario import find

from ...core.config import Config
from ...core.physics.adhesion import WET
from ...core.physics.motion import Motion
from ...core.physics.train import KMH
from ...run.results.score import CONVERGED_AFTER_MPS
from .cramer_rao import MEAN_OF_STD, Bound, Path, Start, bound

PERIOD_S = 0.1

CONDITION_STD = 0.6
"""Before braking: from hardly any adhesion to more than that of a dry rail."""

UNKNOWN_SPEED_MPS = 100.0
"""Before cruising."""


class Case(NamedTuple):
    """A line of the table."""

    scenario: str
    sigma_m: float
    speed_std_kmh: float | None = None
    """Speed known so well when the brake is applied; None: as well as the cruising left it."""


class Nominal(NamedTuple):
    """The bound over a scenario; `limited` marks the samples at which adhesion limits."""

    bound: Bound
    limited: NDArray[np.bool_]

    @property
    def mean_error_percent(self) -> float:
        """Mean relative error of an estimator at the bound, over the times that `score` counts."""
        scored = self.limited & (self.bound.lost_mps > CONVERGED_AFTER_MPS)
        return 100.0 * MEAN_OF_STD * float(self.bound.mu_relative_std[scored].mean())


@cache
def nominal(case: Case) -> Nominal:
    """Bound along the noise-free run of a scenario with a wet rail at the nominal noise."""
    config, scenario = Config(), find(case.scenario)
    truths = list(simulate(scenario, PERIOD_S, np.random.default_rng(0), NO_NOISE))
    if case.speed_std_kmh is not None:
        truths = [truth for truth in truths if truth.pressure_pa > 0.0]
    path = Path(
        t_s=np.array([truth.t_ns for truth in truths]) * 1e-9,
        position_m=np.array([truth.position_m for truth in truths]),
        speed_mps=np.array([truth.speed_mps for truth in truths]),
        brake=np.array([config.brake(truth.pressure_pa) for truth in truths]),
    )
    speed_std = UNKNOWN_SPEED_MPS if case.speed_std_kmh is None else case.speed_std_kmh * KMH
    motion = Motion(scenario.train, scenario.track, config.motion.position_noise_rate, config.motion.speed_noise_rate)
    found = bound(motion, WET, path, case.sigma_m**2, Start(case.sigma_m, speed_std, CONDITION_STD))
    return Nominal(found, np.array([truth.regime == ADHESION_LIMITED for truth in truths]))

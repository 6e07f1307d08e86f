# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The trials behind the tables: scenarios, starts, and the estimators that are compared."""

from collections.abc import Mapping
from dataclasses import replace

from sim_node.train.sensors import SensorSettings

from ..baselines.ekf import NAIVE, TUNED
from ..trial.estimators import EXACT, Estimator
from ..trial.trials import Trials
from ..trial.world import World

STARTS = (0.0, 0.03, 0.05, 0.09, 0.12)
"""Adhesion from which the paper's runs start."""

NOMINAL_SIGMA_M = 0.5
"""Standard deviation of the positions."""

PAPER = replace(EXACT, method="particle_em", window=50, step=10, particles=20, iterations=50)
"""The paper's settings at the nominal noise, those of every method in the tables."""

METHODS: Mapping[str, Estimator] = {
    "bank": Estimator(replace(PAPER, method="bank"), "core"),
    "rail_condition": Estimator(replace(PAPER, method="rail_condition"), "core"),
    "particle_em": Estimator(PAPER, "core"),
    "ekf_tuned": Estimator(PAPER, "ekf", TUNED),
    "ekf_naive": Estimator(PAPER, "ekf", NAIVE),
}
"""By the name that stands in tables and JSON."""


def trials(scenario: str, estimator: Estimator, runs: int, sigma_m: float = NOMINAL_SIGMA_M) -> Trials:
    """Runs of a scenario from every start."""
    world = World(scenario, SensorSettings(position_std_m=sigma_m))
    return Trials(world, estimator, seeds=runs, starts=STARTS)

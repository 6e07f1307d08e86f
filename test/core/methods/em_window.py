# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A window of 30 steps and its E-step, exact or by particles."""

from __future__ import annotations

import numpy as np
from loud_rail import SEEN
from oracles import ExactEStep, make_window

from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.particle_em.em import Expectation, ParticleEStep
from adhesion_node.core.physics.motion import Motion

PRIOR = Gaussian(np.array([100.0, 80.0]), np.array([[0.04, 0.005], [0.005, 0.01]]))


def noisy_window(mu: float = 0.06, seed: int = 10, brake: float = 0.0952) -> Window:
    return make_window(SEEN, PRIOR, mu, np.random.default_rng(seed), steps=30, sigma_m=0.1, brake=brake)


def exactly(window: Window, mu: float) -> Expectation:
    return ExactEStep(SEEN, PRIOR, window)(mu)


def by_particles(motion: Motion, window: Window, count: int, seed: int = 0) -> ParticleEStep:
    return ParticleEStep(motion, count, PRIOR, window, np.random.default_rng(seed))

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The window as a model of the package `particles` (N. Chopin), and its two smoothers by backward sampling."""

from typing import Any

import numpy as np
import particles
from particles import distributions
from particles.state_space_models import Bootstrap, StateSpaceModel

from ...core.physics.train import Array
from ..scene import Scene

UNSEEN_M = 1e6
"""Standard deviation of the measurement at time 0, which the package wants and the window does not have."""


class Braking(StateSpaceModel):
    """The scene at adhesion `mu`; states have shape (N, 2)."""

    scene: Scene
    mu: float

    def PX0(self) -> Any:
        """Law of the first state."""
        prior = self.scene.prior
        return distributions.MvNormal(loc=prior.mean, cov=prior.covariance)

    def PX(self, t: int, xp: Array) -> Any:
        """Law of the state at t."""
        motion, _, window = self.scene
        dt_s = window.dt_s[t - 1]
        position, speed = motion.advance(xp[:, 0], xp[:, 1], dt_s, window.brake[t - 1], self.mu)
        spread_s, spread_v = np.sqrt(np.array(motion.noise(dt_s)))
        return distributions.IndepProd(
            distributions.Normal(loc=position, scale=spread_s), distributions.Normal(loc=speed, scale=spread_v)
        )

    def PY(self, t: int, xp: Array, x: Array) -> Any:
        """Law of the position measured at t."""
        return distributions.Normal(loc=x[:, 0], scale=np.sqrt(self.scene.window.variance_m2[t - 1]) if t else UNSEEN_M)


def _filtered(scene: Scene, mu: float, count: int) -> Any:
    """History of the bootstrap filter; like ours it resamples systematically below an ESS of N/2."""
    model = Braking(scene=scene, mu=mu)
    measured = np.concatenate(([0.0], scene.window.position_m))
    filtered = particles.SMC(fk=Bootstrap(ssm=model, data=measured), N=count, store_history=True)
    filtered.run()
    return filtered.hist


def mcmc(scene: Scene, mu: float, count: int) -> Array:
    """N smoothed trajectories by one Metropolis step per time, O(N); shape (K + 1, N, 2)."""
    return np.array(_filtered(scene, mu, count).backward_sampling_mcmc(count))


def exact(scene: Scene, mu: float, count: int) -> Array:
    """N smoothed trajectories by exact backward sampling, O(N^2); shape (K + 1, N, 2)."""
    return np.array(_filtered(scene, mu, count).backward_sampling_ON2(count))

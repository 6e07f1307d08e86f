# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Particle E and M step of one window: ours, with exact pairwise smoothing, beside the package `particles`.

All use the same model, window, number of particles and M-step; ours is prepared once, as EM does for all its steps.
The peers draw trajectories where ours has weights; that all of them smooth to the same speeds, within their
Monte-Carlo error, is part of the table.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...core.methods.particle_em.em import ParticleEStep, maximise
from ...core.physics.train import Array
from ..scene import MU, Scene, Update, braking_window, maximised
from ..timing import SLOW, Contender, Timed, beside, interleave

OURS, MCMC, EXACT = "ours, exact", "particles, MCMC O(N)", "particles, exact O(N^2)"


def compare(steps: int, count: int, rounds: int, seed: int) -> list[dict[str, Any]]:
    """Rows of the table for windows of so many steps and so many particles."""
    from . import particles_smoother

    rng = np.random.default_rng(seed)
    scene = braking_window(steps, rng)
    contenders = (
        Contender(OURS, partial(_ours, ParticleEStep(scene.motion, count, scene.prior, scene.window, rng)), rounds),
        Contender(MCMC, partial(_sampled, scene, count, particles_smoother.mcmc), rounds),
        Contender(EXACT, partial(_sampled, scene, count, particles_smoother.exact), math.ceil(rounds / SLOW)),
    )
    timed = interleave(contenders)
    return [{"method": name, **_row(timed[name], timed[OURS])} for name in timed]


def _ours(e_step: ParticleEStep) -> Update:
    mu = maximise(e_step(MU), 0.0)
    return Update(mu, np.einsum("kn,kn->k", e_step.marginal, e_step.filter.particles.states[1]))


def _sampled(scene: Scene, count: int, smoother: Callable[[Scene, float, int], Array]) -> Update:
    states = np.moveaxis(smoother(scene, MU, count), 2, 0)
    return Update(
        maximised(scene, states, np.full(states.shape[1:], 1.0 / count), MU),
        states[1].mean(axis=1),
    )


def _row(timed: Timed[Update], ours: Timed[Update]) -> dict[str, Any]:
    """Times, their ratio to ours, and how far the smoothed speeds are from ours, averaged over the calls."""
    (mean, error), (our_mean, our_error) = _mean_speed(timed.results), _mean_speed(ours.results)
    return {
        **beside(timed, ours),
        "mu": float(np.mean([result.mu for result in timed.results])),
        "mu_std": float(np.std([result.mu for result in timed.results])),
        "differs_mps": float(np.sqrt(np.mean((mean - our_mean) ** 2))),
        "monte_carlo_error_mps": float(np.sqrt(np.mean(error**2 + our_error**2))),
    }


def _mean_speed(results: Sequence[Update]) -> tuple[Array, Array]:
    """Mean over the calls and its standard error, each (K + 1,)."""
    speeds = np.array([result.speed_mps for result in results])
    return speeds.mean(axis=0), speeds.std(axis=0) / math.sqrt(len(speeds))

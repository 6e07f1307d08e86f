# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Particle filter, smoother and M-step of a window in NumPy, all at once: what the loops are held against."""

from __future__ import annotations

import numpy as np
from oracles import Array

from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.kernels.filtering import Draws, Particles
from adhesion_node.core.methods.particle_em.particles import Pass
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.train import GRAVITY


def filtered(motion: Motion, prior: Gaussian, window: Window, mu: float, draws: Draws) -> Pass:
    """The bootstrap filter with its likelihood (16), up to the measurements' constants."""
    steps, count = window.steps, draws.start.shape[0]
    states, stepped, logs = np.empty((2, steps + 1, count)), np.empty((2, steps, count)), np.zeros((steps + 1, count))
    states[:, 0] = (prior.mean + draws.start @ np.linalg.cholesky(prior.covariance).T).T
    noise = np.sqrt(np.array(motion.noise(window.dt_s)))[:, :, None] * draws.normal
    weights, log_likelihood, ess = np.ones(count), 0.0, float(count)
    for k in range(steps):
        stepped[:, k] = motion.advance(states[0, k], states[1, k], window.dt_s[k], window.brake[k], mu)
        moved, before = stepped[:, k], logs[k]
        if weights.sum() ** 2 < 0.5 * count * (weights**2).sum():
            log_likelihood += np.log(weights.mean())
            moved, before = moved[:, systematic(weights, draws.uniform[k])], np.zeros(count)
        s, v = states[:, k + 1] = moved + noise[:, k]
        logs[k + 1] = before - 0.5 * (window.position_m[k] - s) ** 2 / window.variance_m2[k]
        logs[k + 1] -= 0.5 * (window.speed_mps[k] - v) ** 2 / window.speed_variance[k]
        log_likelihood += logs[k + 1].max()
        logs[k + 1] -= logs[k + 1].max()
        weights = np.exp(logs[k + 1])
        ess = min(ess, weights.sum() ** 2 / (weights**2).sum())
    return Pass(Particles(states, stepped, logs), float(log_likelihood + np.log(weights.mean())), ess)


def systematic(weights: Array, offset: float) -> Array:
    """Systematic resampling by relative weights, (N,)."""
    count, upto = weights.size, np.cumsum(weights)
    children = np.minimum(upto * (count / upto[-1]) + (1.0 - offset), count).astype(np.intp)
    children[-1] = count
    children[1:] -= children[:-1]
    return np.repeat(np.arange(count), children)


def smoothed(motion: Motion, window: Window, particles: Particles) -> Array:
    """Smoothed weights (27), (K + 1, N)."""
    states, stepped, logs = particles
    marginal, spread = np.empty(logs.shape), np.sqrt(np.array(motion.noise(window.dt_s)))
    marginal[-1] = np.exp(logs[-1])
    marginal[-1] /= marginal[-1].sum()
    for k in range(window.steps - 1, -1, -1):
        off = (stepped[:, k, :, None] - states[:, k + 1, None, :]) / spread[:, k, None, None]
        exponents = logs[k][:, None] - 0.5 * (off**2).sum(axis=0)
        kernel = np.exp(exponents - exponents.max(axis=0))
        marginal[k] = kernel @ (marginal[k + 1] / kernel.sum(axis=0))
    return marginal


def reduced(motion: Motion, window: Window, mu: float, particles: Particles, marginal: Array) -> Array:
    """Adhesion used, its information and limit in each step, (3, K)."""
    states, stepped, _ = particles
    missed = (stepped * marginal[:-1]).sum(axis=2) - (states[:, 1:] * marginal[1:]).sum(axis=2)
    resistance, brake = motion.resistance(states[0, :-1], states[1, :-1]), window.brake
    used = (motion.train.used_adhesion(mu, brake[:, None], resistance) * marginal[:-1]).sum(axis=1)
    limit = motion.train.used_adhesion(np.inf, brake, (resistance * marginal[:-1]).sum(axis=1))
    effect = GRAVITY * window.dt_s * np.stack([0.5 * window.dt_s, np.ones(window.steps)])
    variance = np.array(motion.noise(window.dt_s))
    weight = (effect**2 / variance).sum(axis=0)
    return np.array((used + (effect * missed / variance).sum(axis=0) / weight, weight, limit))

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Independent oracles for the core: numpy and scipy only, textbook form, with model matrices of their own.

The oracle's train has a resistance that is affine in speed, so that its motion is exactly linear and the Kalman
filter and the Rauch-Tung-Striebel smoother are the exact answers.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from adhesion_node.core import Config, Estimate, State, finish, init, step
from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.window import Window
from adhesion_node.core.intake.samples import Measurement
from adhesion_node.core.methods.particle_em.em import Expectation
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import LEVEL
from adhesion_node.core.physics.train import Train

Array = NDArray[np.float64]
G = 9.8


class Linear(NamedTuple):
    """x' = A x - g T (min(mu, brake) + c0) (T/2, 1) + w, w ~ N(0, T diag(q_s, q_v)); c1 of (6) stands in A."""

    c0: float = 0.0
    c1: float = 0.0
    q_s: float = 0.02**2 / 0.1
    q_v: float = (0.02 / 3.6) ** 2 / 0.1

    @property
    def motion(self) -> Motion:
        """The core's model of the same train."""
        train = Train(resistance_c0=self.c0, resistance_c1=self.c1, resistance_c2=0.0)
        return Motion(train, LEVEL, self.q_s, self.q_v)

    def matrix(self, dt: float) -> Array:
        """A."""
        kept = 1.0 - G * dt * self.c1 * 3.6 / 1000.0
        return np.array([[1.0, dt * (1.0 + kept) / 2.0], [0.0, kept]])

    def push(self, dt: float, used: float) -> Array:
        """What the brake and c0 do to (s, v) in one step."""
        return -G * dt * (used + self.c0 / 1000.0) * np.array([dt / 2.0, 1.0])

    def noise(self, dt: float) -> Array:
        """Covariance of w."""
        return dt * np.diag([self.q_s, self.q_v])


class Exact(NamedTuple):
    """Exact laws of the K + 1 states of a window; index 0 is the prior's."""

    filtered_mean: Array
    filtered_cov: Array
    mean: Array
    """Smoothed."""
    cov: Array
    log_likelihood: float


def rts(model: Linear, prior: Gaussian, window: Window, mu: float) -> Exact:
    """Kalman filter, then Rauch-Tung-Striebel smoother."""
    means, covs, predicted = [prior.mean], [prior.covariance], []
    log_likelihood = 0.0
    for k in range(window.steps):
        dt = float(window.dt_s[k])
        a = model.matrix(dt)
        m = a @ means[-1] + model.push(dt, min(mu, float(window.brake[k])))
        p = a @ covs[-1] @ a.T + model.noise(dt)
        predicted.append((a, m, p))
        with_speed = bool(np.isfinite(window.speed_variance[k]))
        h = np.eye(2)[: 1 + with_speed]
        y = np.array([window.position_m[k], window.speed_mps[k]])[: 1 + with_speed]
        r = np.diag(np.array([window.variance_m2[k], window.speed_variance[k]])[: 1 + with_speed])
        s = h @ p @ h.T + r
        e = y - h @ m
        log_likelihood -= 0.5 * float(e @ np.linalg.inv(s) @ e + np.log(np.linalg.det(2.0 * np.pi * s)))
        gain = p @ h.T @ np.linalg.inv(s)
        means.append(m + gain @ e)
        covs.append(p - gain @ s @ gain.T)
    smooth_mean, smooth_cov = [means[-1]], [covs[-1]]
    for k in range(window.steps - 1, -1, -1):
        a, m, p = predicted[k]
        back = covs[k] @ a.T @ np.linalg.inv(p)
        smooth_mean.insert(0, means[k] + back @ (smooth_mean[0] - m))
        smooth_cov.insert(0, covs[k] + back @ (smooth_cov[0] - p) @ back.T)
    return Exact(np.array(means), np.array(covs), np.array(smooth_mean), np.array(smooth_cov), log_likelihood)


def log_likelihood(model: Linear, prior: Gaussian, window: Window, mu: float) -> float:
    """ln p(y_1:K) at adhesion `mu`."""
    return rts(model, prior, window, mu).log_likelihood


def dense_information(model: Linear, prior: Gaussian, window: Window, mu: float) -> float:
    """Information on mu in the positions, h' C^-1 h: mean slope h and covariance C of all K of them at once."""
    slope: Array = np.zeros(2)
    slopes = []
    maps: list[Array] = [np.eye(2)]  # state k as a linear function of x_0 and of each noise
    noises: list[list[Array]] = [[]]
    for k in range(window.steps):
        dt = float(window.dt_s[k])
        a = model.matrix(dt)
        slope = a @ slope + (model.push(dt, 1.0) - model.push(dt, 0.0)) * (mu <= window.brake[k])
        slopes.append(slope[0])
        maps.append(a @ maps[-1])
        noises.append([a @ n for n in noises[-1]] + [np.sqrt(model.noise(dt))])
    c = np.diag(window.variance_m2)
    for i in range(window.steps):
        for j in range(window.steps):
            c[i, j] += (maps[i + 1] @ prior.covariance @ maps[j + 1].T)[0, 0]
            c[i, j] += sum((a @ b.T)[0, 0] for a, b in zip(noises[i + 1], noises[j + 1], strict=False))
    h = np.array(slopes)
    return float(h @ np.linalg.solve(c, h))


class ExactEStep(NamedTuple):
    """The E-step of the oracle's train without any sampling: I2 is quadratic, so smoothed means are enough."""

    model: Linear
    prior: Gaussian
    window: Window

    def __call__(self, mu: float) -> Expectation:
        """Statistics of Q from the exact smoother of this one window, information on mu by dense algebra."""
        exact = rts(self.model, self.prior, self.window, mu)
        used, weight = [], []
        for k in range(self.window.steps):
            dt = float(self.window.dt_s[k])
            per_mu = self.model.push(dt, 1.0) - self.model.push(dt, 0.0)
            moved = exact.mean[k + 1] - self.model.matrix(dt) @ exact.mean[k] - self.model.push(dt, 0.0)
            precision = np.linalg.inv(self.model.noise(dt))
            weight.append(per_mu @ precision @ per_mu)
            used.append(per_mu @ precision @ moved / weight[-1])
        statistics = np.array((used, weight, self.window.brake))
        observed = dense_information(self.model, self.prior, self.window, min(mu, float(self.window.brake.max())))
        return Expectation(statistics, observed, exact.log_likelihood, math.inf)


def make_window(
    model: Linear,
    prior: Gaussian,
    mu: float,
    rng: np.random.Generator,
    *,
    steps: int = 20,
    dt_s: float = 0.1,
    sigma_m: float = 0.5,
    brake: float = 0.0952,
) -> Window:
    """Draw a window from the oracle's train: its start from the prior, then its motion, then its measurements."""
    x, positions = prior.mean + np.linalg.cholesky(prior.covariance) @ rng.standard_normal(2), []
    for _ in range(steps):
        w = np.sqrt(np.diag(model.noise(dt_s))) * rng.standard_normal(2)
        x = model.matrix(dt_s) @ x + model.push(dt_s, min(mu, brake)) + w
        positions.append(x[0] + sigma_m * rng.standard_normal())
    full = np.ones(steps)
    return Window(dt_s * full, brake * full, np.array(positions), sigma_m**2 * full, 0.0 * full, math.inf * full)


def literal_pairwise(filter_weights: Array, densities: Array, last: Array) -> tuple[list[Array], list[Array]]:
    """(27) as printed, in plain loops: pairwise weights and marginals from p(x^j_t+1 | x^i_t), shape (K, N, N)."""
    steps, count, _ = densities.shape
    marginals, pairs = [last], list[Array]()
    for t in range(steps - 1, -1, -1):
        pair = np.empty((count, count))
        for j in range(count):
            total = 0.0
            for m in range(count):
                total += filter_weights[t, m] * densities[t, m, j]
            for i in range(count):
                pair[i, j] = filter_weights[t, i] * marginals[0][j] * densities[t, i, j] / total
        pairs.insert(0, pair)
        marginals.insert(0, np.array([sum(pair[i]) for i in range(count)]))
    return pairs, marginals


def log_densities(states: Array, motion: Motion, window: Window, mu: float, per_mille: float = 0.0) -> Array:
    """ln p(x^j_t+1 | x^i_t) of states (2, K + 1, N), shape (K, N, N), spelled out for the CRH3 on a grade."""
    steps, count = window.steps, states.shape[2]
    log_density = np.empty((steps, count, count))
    for t in range(steps):
        dt = float(window.dt_s[t])
        s, v = states[:, t]
        slower = v - dt * G * (min(mu, float(window.brake[t])) + specific_resistance(v) + per_mille / 1000.0)
        moved = s + dt * (v + slower) / 2
        std_s, std_v = math.sqrt(motion.position_noise_rate * dt), math.sqrt(motion.speed_noise_rate * dt)
        by_s = stats.norm.logpdf(states[0, t + 1], moved[:, np.newaxis], std_s)
        log_density[t] = by_s + stats.norm.logpdf(states[1, t + 1], slower[:, np.newaxis], std_v)
    return log_density


def specific_resistance(speed_mps: Array) -> Array:
    """(6) of the CRH3 as published, N/N."""
    kmh = 3.6 * speed_mps
    return (0.79 + 0.0064 * kmh + 0.000115 * kmh**2) / 1000.0


def ride(
    phases: list[tuple[float, float | None]],
    mu: float = 0.0726,
    *,
    speed_mps: float = 80.0,
    sigma_m: float = 0.5,
    period_s: float = 0.1,
    seed: int = 0,
) -> list[Measurement]:
    """Measurements of a CRH3 through phases of (duration s, gauge pressure Pa); without pressure it holds its speed.

    The brake takes min(mu, 0.0952 P / 410 kPa) of the weight; a train at rest stays there.
    """
    rng = np.random.default_rng(seed)
    pressures = [pressure for duration, pressure in phases for _ in range(round(duration / period_s))]
    s, v, measurements = 0.0, speed_mps, []
    for k, pressure in enumerate(pressures):
        y = s + sigma_m * float(rng.standard_normal())
        measurements.append(Measurement(round(k * period_s * 1e9), y, sigma_m**2, pressure))
        a = 0.0 if not pressure else G * (min(mu, 0.09522 * pressure / 410e3) + float(specific_resistance(np.array(v))))
        slower = max(v - a * period_s, 0.0)
        s, v = s + period_s * (v + slower) / 2.0, slower
    return measurements


def drive(config: Config, measurements: Iterable[Measurement], seed: int = 1) -> tuple[State, list[Estimate]]:
    """The estimator through a whole stream: its last state and all that it gave, the last short window included."""
    state, estimates = init(config, seed), []
    for measurement in measurements:
        state, estimate = step(config, state, measurement)
        estimates += [] if estimate is None else [estimate]
    state, last = finish(config, state)
    return state, [*estimates, *last]

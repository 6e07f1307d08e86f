# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Independent oracles for the rail condition: the oracle's linear train with kappa as a third state.

On a law that does not depend on the speed, mu = kappa floor, its motion is exactly linear in (s, v, kappa), so that
textbook recursions and one dense Gaussian of everything at once are the exact answers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from oracles import Array, Linear, rts
from scipy import stats

from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.rail_condition.problem import Belief, Model, Problem
from adhesion_node.core.physics.adhesion import SpeedLaw


class Conditioned(NamedTuple):
    """The oracle's train on a rail of mu = kappa floor; steps with a brake below `limited_below` are at its limit."""

    train: Linear
    floor: float
    limited_below: float = 0.0

    def problem(self, window: Window, prior: Belief, tail_dof: float = 0.0) -> Problem:
        """The core's problem of the same window."""
        return Problem(Model(self.train.motion, SpeedLaw(self.floor), tail_dof), window, prior)

    def step(self, window: Window, k: int) -> tuple[Array, Array, Array]:
        """A, b and d of step k: x' = A x + b kappa + d."""
        dt, brake = float(window.dt_s[k]), float(window.brake[k])
        rest = self.train.push(dt, 0.0)
        if brake < self.limited_below:
            return self.train.matrix(dt), np.zeros(2), self.train.push(dt, brake)
        return self.train.matrix(dt), self.train.push(dt, self.floor) - rest, rest


def draw(
    rail: Conditioned,
    kappas: Array,
    rng: np.random.Generator,
    *,
    start: tuple[float, float] = (100.0, 80.0),
    gaps: Sequence[int] = (),
    brake: float | Array = 0.0952,
    speeds: int = 0,
    sigma_m: float = 0.1,
) -> Window:
    """Draw a window of one step for each of `kappas`, 0.1 s long, or 0.3 s where `gaps` says so.

    Every `speeds`-th step has a measured speed of standard deviation 0.2 m/s; 0: none.
    """
    count = kappas.size
    dt = np.where(np.isin(np.arange(count), gaps), 0.3, 0.1)
    with_speed = np.arange(count) % speeds == 0 if speeds else np.zeros(count, dtype=bool)
    blank = np.zeros(count)
    empty = Window(dt, np.broadcast_to(brake, count).astype(float), blank, blank, blank, blank)
    x, states = np.array(start), []
    for k, kappa in enumerate(kappas):
        a, b, d = rail.step(empty, k)
        x = a @ x + b * kappa + d + np.sqrt(np.diag(rail.train.noise(float(dt[k])))) * rng.standard_normal(2)
        states.append(x)
    measured = np.array(states) + rng.standard_normal((count, 2)) * [sigma_m, 0.2]
    return replace(
        empty,
        position_m=measured[:, 0],
        variance_m2=np.full(count, sigma_m**2),
        speed_mps=measured[:, 1],
        speed_variance=np.where(with_speed, 0.04, math.inf),
    )


class Smooth(NamedTuple):
    """Laws of (s, v, kappa) at the K + 1 times of a window; index 0 is the prior's."""

    filtered_mean: Array
    filtered_cov: Array
    mean: Array
    """Smoothed."""
    cov: Array
    log_likelihood: float


def smoothed(rail: Conditioned, prior: Belief, window: Window) -> Smooth:
    """Kalman filter of the augmented state, measured values one by one, then Rauch-Tung-Striebel smoother."""
    means, covs, predicted = [prior.mean], [prior.covariance], []
    log_likelihood = 0.0
    for k in range(window.steps):
        a, b, d = rail.step(window, k)
        f = np.block([[a, b[:, None]], [np.zeros((1, 2)), np.eye(1)]])
        m = f @ means[-1] + np.append(d, 0.0)
        p = f @ covs[-1] @ f.T
        p[:2, :2] += rail.train.noise(float(window.dt_s[k]))
        predicted.append((f, m, p))
        measured = ((window.position_m[k], window.variance_m2[k]), (window.speed_mps[k], window.speed_variance[k]))
        for index, (value, variance) in enumerate(measured):
            if math.isfinite(variance):
                s, e = p[index, index] + variance, value - m[index]
                log_likelihood -= 0.5 * (e**2 / s + math.log(2.0 * math.pi * s))
                gain = p[:, index] / s
                m, p = m + gain * e, p - s * np.outer(gain, gain)
        means.append(m)
        covs.append(p)
    back_mean, back_cov = [means[-1]], [covs[-1]]
    for k in range(window.steps - 1, -1, -1):
        f, m, p = predicted[k]
        back = covs[k] @ f.T @ np.linalg.inv(p)
        back_mean.insert(0, means[k] + back @ (back_mean[0] - m))
        back_cov.insert(0, covs[k] + back @ (back_cov[0] - p) @ back.T)
    return Smooth(np.array(means), np.array(covs), np.array(back_mean), np.array(back_cov), log_likelihood)


def em_kappa(rail: Conditioned, prior: Belief, window: Window, start: float) -> float:
    """Plain EM for kappa, iterated until it stands still: smoother at fixed kappa, then the maximum in closed form."""
    precision, kappa = np.linalg.inv(prior.covariance), start
    across = prior.covariance[:2, 2]
    for _ in range(20_000):
        given = Gaussian(
            prior.mean[:2] + across / prior.covariance[2, 2] * (kappa - prior.mean[2]),
            prior.covariance[:2, :2] - np.outer(across, across) / prior.covariance[2, 2],
        )
        states = rts(rail.train, given, window, kappa * rail.floor).mean
        weight = precision[2, 2]
        total = precision[2, 2] * prior.mean[2] - float(precision[2, :2] @ (states[0] - prior.mean[:2]))
        for k in range(window.steps):
            a, b, d = rail.step(window, k)
            per = np.linalg.solve(rail.train.noise(float(window.dt_s[k])), b)
            weight += float(per @ b)
            total += float(per @ (states[k + 1] - a @ states[k] - d))
        before, kappa = kappa, float(total / weight)
        if abs(kappa - before) < 1e-10:
            return kappa
    raise AssertionError("the oracle's EM did not converge")


class Joint(NamedTuple):
    """Gaussian of (x_0, ..., x_K, kappa at the end) and the measured values, all at once."""

    mean: Array
    covariance: Array
    seen: Array
    """Measured values = seen @ states + noise."""
    values: Array
    variances: Array

    @property
    def log_evidence(self) -> float:
        """ln p(y) by scipy's density."""
        spread = self.seen @ self.covariance @ self.seen.T + np.diag(self.variances)
        return float(stats.multivariate_normal(self.seen @ self.mean, spread).logpdf(self.values))

    @property
    def end(self) -> Belief:
        """Law of (s, v, kappa) at the end, given the measurements."""
        spread = self.seen @ self.covariance @ self.seen.T + np.diag(self.variances)
        gain = np.linalg.solve(spread, self.seen @ self.covariance).T
        mean = self.mean + gain @ (self.values - self.seen @ self.mean)
        covariance = self.covariance - gain @ self.seen @ self.covariance
        return Belief(mean[-3:], covariance[-3:, -3:])


def joint(rail: Conditioned, prior: Belief, window: Window, jump_at: int | None = None, jump_std: float = 0.0) -> Joint:
    """Everything as a linear map of its sources (x_0, kappa, jump, w_1, ..., w_K); kappa jumps at step `jump_at`."""
    count = window.steps
    sources = np.zeros((4 + 2 * count, 4 + 2 * count))
    sources[:3, :3], sources[3, 3] = prior.covariance, jump_std**2
    x, kappa = np.eye(2, len(sources)), np.eye(1, len(sources), 2)[0]
    mean, rows, means = prior.mean[:2], [x], [prior.mean[:2]]
    for k in range(count):
        a, b, d = rail.step(window, k)
        own = slice(4 + 2 * k, 6 + 2 * k)
        sources[own, own] = rail.train.noise(float(window.dt_s[k]))
        if k == jump_at:
            kappa = kappa + np.eye(1, len(sources), 3)[0]
        x = a @ x + np.outer(b, kappa)
        x[:, own] += np.eye(2)
        mean = a @ mean + b * prior.mean[2] + d
        rows.append(x)
        means.append(mean)
    maps = np.vstack([*rows, kappa])
    values = np.column_stack([window.position_m, window.speed_mps]).ravel()
    variances = np.column_stack([window.variance_m2, window.speed_variance]).ravel()
    kept = np.isfinite(variances)
    seen = np.eye(2 * count, 2 * count + 3, 2)[kept]
    return Joint(np.append(means, prior.mean[2]), maps @ sources @ maps.T, seen, values[kept], variances[kept])

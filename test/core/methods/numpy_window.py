# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A window's normal equation in NumPy, as one dense matrix: what the compiled loops are held against."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from oracles import Array

from adhesion_node.core.methods.kernels.equation import LIMIT_TOLERANCE, WEIGHT_TOLERANCE
from adhesion_node.core.methods.rail_condition.problem import Belief, Problem
from adhesion_node.core.methods.rail_condition.smoother import KappaSearch, Posterior, Smoothed
from adhesion_node.core.physics.train import GRAVITY


class Steps(NamedTuple):
    """x' = f + F dx + G dkappa about a trajectory, with F = [[1, half], [0, kept]]."""

    moving: Array
    """What moves (s', v'), shape (3, 2, K): dv by (half, kept), dkappa by G, and the trajectory's own deviation."""
    headroom: Array


class Equation(NamedTuple):
    """H (dx, dkappa) = g."""

    matrix: Array
    right: Array
    misfit: float

    @property
    def step(self) -> Array:
        """Of the states and kappa, shape (2K + 3,)."""
        return np.asarray(np.linalg.solve(self.matrix, self.right), dtype=np.float64)


def linearised(problem: Problem, trajectory: Array, kappa: float) -> Steps:
    """Linearise the steps about the trajectory, shape (K + 1, 2), at kappa."""
    motion, window, law = problem.model.motion, problem.window, problem.model.law
    position, speed = trajectory[:-1].T
    half_dt, adhesion = 0.5 * window.dt_s, law(speed)
    resistance, resisting = motion.resistance(position, speed), motion.train.resistance_slope(speed)
    limit = motion.train.used_adhesion(np.inf, window.brake, resistance)
    used = np.minimum(kappa * adhesion, limit)
    limited_slope = resisting / (1.0 + motion.train.rotating_mass_fraction)
    slope = np.where(used < limit, kappa * law.slope(speed) + resisting, limited_slope)
    loss = GRAVITY * window.dt_s
    next_speed = speed - loss * (used + resistance)
    kept, effect = 1.0 - loss * slope, -loss * adhesion
    errors = trajectory[1:, 0] - position - half_dt * (speed + next_speed), trajectory[1:, 1] - next_speed
    moving = np.array([(half_dt * (1.0 + kept), kept), (half_dt * effect, effect), errors])
    return Steps(moving, limit / adhesion - kappa)


def equation(problem: Problem, trajectory: Array, kappa: float, weights: Array, margin: float = 0.0) -> Equation:
    """Assemble the equation at the trajectory and kappa, as J^T J of whitened residuals."""
    window, prior, count = problem.window, problem.prior, problem.window.steps
    steps = linearised(problem, trajectory, kappa)
    free = steps.headroom > margin
    jacobian, residual = np.zeros((3 + 4 * count, 2 * count + 3)), np.zeros(3 + 4 * count)
    root = np.linalg.cholesky(np.linalg.inv(prior.covariance)).T
    jacobian[:3, [0, 1, -1]] = root
    residual[:3] = root @ (prior.mean - np.array([*trajectory[0], kappa]))
    certainty = 1.0 / np.sqrt(np.array(problem.model.motion.noise(window.dt_s)))
    for k in range(count):
        for c in range(2):
            row = jacobian[3 + 2 * k + c]
            row[2 * k + c], row[2 * k + 2 + c] = -1.0, 1.0
            row[2 * k + 1] -= steps.moving[0, c, k] - (c == 1)
            row[-1] = -steps.moving[1, c, k] * free[k]
            row *= certainty[c, k]
            residual[3 + 2 * k + c] = -certainty[c, k] * steps.moving[2, c, k]
    misfit = 0.5 * float(residual @ residual)
    sure = np.sqrt(np.stack((weights / window.variance_m2, 1.0 / window.speed_variance), axis=1)).ravel()
    jacobian[3 + 2 * count :, 2:-1] = np.diag(sure)
    off = np.stack((window.position_m, window.speed_mps), axis=1) - trajectory[1:]
    residual[3 + 2 * count :] = sure * off.ravel()
    return Equation(jacobian.T @ jacobian, jacobian.T @ residual, misfit)


def smoothed(problem: Problem, search: KappaSearch, near: Array) -> Smoothed:
    """The search for kappa, from a trajectory, shape (K + 1, 2), on."""
    trajectory, kappa = near, search.start
    weights = problem.model.weights(problem.squared(trajectory))
    low, high, iterations, converged = search.lowest, np.inf, 0, False
    while iterations < search.iterations and not converged:
        iterations += 1
        headroom = linearised(problem, trajectory, kappa).headroom
        step = equation(problem, trajectory, kappa, weights).step
        limits = kappa + headroom.min(), kappa + headroom.max()
        if step[-1] > 0.0:
            low = max(low, kappa)
        elif kappa >= limits[0]:
            high = min(high, kappa)
        following = max(kappa + step[-1], search.lowest)
        if max(kappa, following) >= limits[0] and abs(step[-1]) > search.tolerance and not low < following < high:
            following = 0.5 * (max(low, min(limits[0], high)) + min(high, max(limits[1], low)))
        trajectory, change, kappa = trajectory + step[:-1].reshape(-1, 2), following - kappa, following
        before, weights = weights, problem.model.weights(problem.squared(trajectory))
        settled = abs(change) <= search.tolerance or high - low <= LIMIT_TOLERANCE * kappa
        converged = bool(settled and np.abs(weights - before).max() <= WEIGHT_TOLERANCE)
    headroom = linearised(problem, trajectory, kappa).headroom
    return Smoothed(trajectory, kappa, weights, headroom, iterations, converged)


def posterior(problem: Problem, found: Smoothed, margin: float) -> Posterior:
    """Law of the last state and kappa, and evidence."""
    at = equation(problem, found.trajectory, found.kappa, found.weights, margin)
    window, dof, step = problem.window, problem.model.tail_dof, at.step
    squared = problem.squared(found.trajectory)
    misfit = at.misfit + 0.5 * (np.sum((dof + 1.0) * np.log1p(squared / dof)) if dof else squared.sum())
    misfit += 0.5 * np.sum((window.speed_mps - found.trajectory[1:, 1]) ** 2 / window.speed_variance)
    spread = np.linalg.slogdet(at.matrix)[1] + np.linalg.slogdet(problem.prior.covariance)[1]
    mean = step[-3:] + np.array([*found.trajectory[-1], found.kappa])
    belief = Belief(mean, np.asarray(np.linalg.inv(at.matrix)[-3:, -3:], dtype=np.float64))
    return Posterior(belief, float(0.5 * at.right @ step - misfit - 0.5 * spread))


def tried(problem: Problem, found: Smoothed, first: int, std: float, *, of_rail: bool) -> tuple[Array, float, float]:
    """A jump from the step `first` on: what moves of states, kappa and jump, the odds, the jump's variance."""
    window, later = problem.window, np.arange(problem.window.steps) >= first
    at = equation(problem, found.trajectory, found.kappa, found.weights)
    steps, size = linearised(problem, found.trajectory, found.kappa), len(at.right)
    if of_rail:
        certainty = 1.0 / np.array(problem.model.motion.noise(window.dt_s))
        effect, error = steps.moving[1] * later, steps.moving[2]
        rows = np.zeros((2 * window.steps, size))
        for k in range(window.steps):
            for c in range(2):
                rows[2 * k + c, [2 * k + c, 2 * k + 2 + c]] = 1.0, -1.0
                rows[2 * k + c, 2 * k + 1] += steps.moving[0, c, k] - (c == 1)
                rows[2 * k + c, -1] = steps.moving[1, c, k] * (steps.headroom[k] > 0.0)
        by, off = (certainty * effect).T.ravel(), error.T.ravel()
        border, own, pull = by @ rows, by @ effect.T.ravel(), by @ off
    else:
        seen = found.weights / window.variance_m2 * later
        border, own = np.zeros(size), seen.sum()
        border[2:-1:2] = seen
        pull = seen @ (window.position_m - found.trajectory[1:, 0])
    matrix = np.block([[at.matrix, border[:, None]], [border[None, :], np.array([[own + std**-2]])]])
    step, inverse = np.linalg.solve(matrix, np.append(at.right, pull)), np.linalg.inv(matrix)
    return step, float(0.5 * step[-1] ** 2 / inverse[-1, -1] + 0.5 * np.log(inverse[-1, -1] / std**2)), inverse[-1, -1]

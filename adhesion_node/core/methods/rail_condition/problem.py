# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A window as a least-squares problem in its trajectory and in kappa, where the adhesion is mu(v) = kappa law(v)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpotrf, dtrtri

from ...belief.window import Window
from ...physics.adhesion import SpeedLaw
from ...physics.motion import Motion
from ...physics.train import GRAVITY, Array
from .banded import Factor, factorise

LOG_2PI = math.log(2.0 * math.pi)


class Belief(NamedTuple):
    """Gaussian belief of position, m, speed, m/s, and a third quantity, kappa or mu: mean (3,), covariance (3, 3)."""

    mean: Array
    covariance: Array


@dataclass(frozen=True, slots=True)
class Model:
    """The train, the rail's speed law and the tails of the measurements' law."""

    motion: Motion
    law: SpeedLaw
    tail_dof: float
    """Degrees of freedom of the measured positions' Student t; 0 for Gaussian."""

    def weights(self, squared: Array) -> Array:
        """Weights of measurements whose deviations have this square, in variances.

        EM weights of Student's t times its expected information per measurement, (dof + 1)/(dof + 3), so that the
        weighted system has the right curvature too.
        """
        if self.tail_dof == 0.0:
            return np.ones_like(squared)
        dof = self.tail_dof
        return (dof + 1.0) ** 2 / (dof + 3.0) / (dof + squared)

    def loss(self, squared: Array) -> float:
        """-ln p of the measurements, up to a constant."""
        if self.tail_dof == 0.0:
            return 0.5 * float(squared.sum())
        return 0.5 * (self.tail_dof + 1.0) * float(np.log1p(squared / self.tail_dof).sum())

    def log_peak(self, variances: Array) -> float:
        """ln p of measurements without deviation, by their variances: the constant that `loss` leaves out."""
        scale = -0.5 * float(np.log(variances).sum())
        if self.tail_dof == 0.0:
            return scale - 0.5 * LOG_2PI * variances.size
        half = 0.5 * self.tail_dof
        return scale + variances.size * (
            math.lgamma(half + 0.5) - math.lgamma(half) - 0.5 * math.log(2.0 * math.pi * half)
        )


class Steps(NamedTuple):
    """The steps of a window about a trajectory: x' = f + F dx + G dkappa.

    F = [[1, half], [0, kept]] and G = effect (dt/2, 1); everything has shape (..., K).
    """

    moving: Array
    """What moves (s', v'), shape (3, 2, K): dv by (half, kept), dkappa by G, and the trajectory's own deviation."""
    weighted: Array
    """The same, by the certainty of s' and of v'."""
    on_speed: Array
    """What of it the speed before the step feels, (half, kept) . weighted, shape (3, K)."""
    headroom: Array
    """kappa at which the brake begins to limit, less the present kappa."""

    def beginning(self, count: int) -> Steps:
        """The first `count` steps."""
        return Steps(*(part[..., :count] for part in self))


class Normal(NamedTuple):
    """Normal equations at some trajectory and kappa: factorised curvature of -ln p, and minus its gradient."""

    factor: Factor
    states: Array
    """Shape (2K + 2,)."""
    kappa: float
    misfit: float
    """-ln p of the trajectory and kappa before the measurements, up to a constant."""

    def step(self) -> tuple[Array, float]:
        """Gauss-Newton step of the trajectory, shape (K + 1, 2), and of kappa."""
        states, moved = self.factor.solve(self.states, self.kappa)
        return states.reshape(-1, 2), float(moved)


@dataclass(frozen=True)
class Problem:
    """A window, the law of its first state and of kappa, and the model of both."""

    model: Model
    window: Window
    prior: Belief

    @cached_property
    def whitening(self) -> Array:
        """Inverse of the Cholesky factor of the prior's covariance, shape (3, 3).

        Raises numpy.linalg.LinAlgError when that is not positive definite.
        """
        cholesky, failed = dpotrf(self.prior.covariance, lower=1)
        if failed:
            raise np.linalg.LinAlgError(f"the prior's covariance {self.prior.covariance} is not positive definite")
        result: Array = dtrtri(cholesky, lower=1)[0]
        return result

    @cached_property
    def precision(self) -> Array:
        """Inverse of the prior's covariance, shape (3, 3)."""
        result: Array = self.whitening.T @ self.whitening
        return result

    @cached_property
    def certainty(self) -> Array:
        """Inverse variances of the process noise of position and speed, shape (2, K)."""
        return 1.0 / np.array(self.model.motion.noise(self.window.dt_s))

    @cached_property
    def constant(self) -> Array:
        """What the prior and the process noise add to the band of any trajectory, shape (K + 1, 2, 3)."""
        band = np.zeros((self.window.steps + 1, 2, 3))
        band[1:, :, 0] = self.certainty.T
        band[:-1, 0, 0] += self.certainty[0]
        band[:-1, 0, 2] = -self.certainty[0]
        band[0, :, 0] += np.diag(self.precision)[:2]
        return band

    @property
    def log_constant(self) -> float:
        """What all hypotheses share of ln p(y), and so `Posterior.log_evidence` leaves out."""
        window = self.window
        speeds = window.speed_variance[np.isfinite(window.speed_variance)]
        gaussian = 0.5 * float(np.log(self.certainty).sum()) - 0.5 * float((np.log(speeds) + LOG_2PI).sum())
        return gaussian + self.model.log_peak(window.variance_m2)

    def squared(self, trajectory: Array, shift: float | Array = 0.0) -> Array:
        """Squared deviations of the measured positions, less their shift, from the trajectory, in variances: (K,)."""
        result: Array = (self.window.position_m - shift - trajectory[1:, 0]) ** 2 * self.window.information[:, 0]
        return result

    def linearise(self, trajectory: Array, kappa: float) -> Steps:
        """Linearise the steps about the trajectory, shape (K + 1, 2), at kappa."""
        motion, window, law = self.model.motion, self.window, self.model.law
        position, speed = trajectory[:-1].T
        half_dt, adhesion = 0.5 * window.dt_s, law(speed)
        resistance = motion.resistance(position, speed)
        resisting = motion.train.resistance_slope(speed)
        limit = motion.train.used_adhesion(np.inf, window.brake, resistance)
        used = np.minimum(kappa * adhesion, limit)
        # while the brake limits, part of the resistance goes into the rotating masses
        limited_slope = resisting / (1.0 + motion.train.rotating_mass_fraction)
        slope = np.where(used < limit, kappa * law.slope(speed) + resisting, limited_slope)
        loss = GRAVITY * window.dt_s
        next_speed = speed - loss * (used + resistance)

        moving = np.empty((3, 2, window.steps))
        (half, kept), (effect_s, effect), (error_s, error) = moving
        kept[:] = 1.0 - loss * slope
        half[:] = half_dt * (1.0 + kept)
        effect[:] = -loss * adhesion
        effect_s[:] = half_dt * effect
        error[:] = trajectory[1:, 1] - next_speed
        error_s[:] = trajectory[1:, 0] - position - half_dt * (speed + next_speed)
        weighted = self.certainty * moving
        felt = weighted * moving[0]
        return Steps(moving, weighted, felt[:, 0] + felt[:, 1], limit / adhesion - kappa)

    def normal(self, steps: Steps, trajectory: Array, kappa: float, weights: Array, margin: float = 0.0) -> Normal:
        """Assemble and factorise the normal equations at the trajectory and kappa about which `steps` are.

        Steps with less headroom than `margin` do not depend on kappa: there the brake limits, or might.
        """
        window, precision = self.window, self.precision
        (to_speed, to_kappa, force), (speeds, on_kappa, on_force) = steps.weighted, steps.on_speed
        free = (steps.headroom > margin).astype(np.float64)
        to_kappa = to_kappa * free
        seen = window.information.copy()
        seen[:, 0] *= weights

        band = self.constant.copy()
        band[1:, :, 0] += seen
        band[:-1, 1, 0] += speeds
        band[:-1, 0, 1] = to_speed[0]
        band[:-1, 1, 1] = -to_speed[0]
        band[:-1, 1, 2] = -to_speed[1]
        band[0, 0, 1] += precision[0, 1]

        border = np.zeros((window.steps + 1, 2))
        border[:-1, 0] = to_kappa[0]
        border[:-1, 1] = on_kappa * free
        border[1:] -= to_kappa.T
        border[0] += precision[2, :2]
        corner = precision[2, 2] + np.vdot(to_kappa, steps.moving[1])

        deviation = self.prior.mean - np.array([*trajectory[0], kappa])
        pulled = precision @ deviation
        states = np.zeros((window.steps + 1, 2))
        states[:-1, 0] = force[0]
        states[:-1, 1] = on_force
        states[1:] += seen * (window.measured - trajectory[1:]) - force.T
        states[0] += pulled[:2]
        push = pulled[2] + np.vdot(to_kappa, steps.moving[2])
        misfit = 0.5 * float(np.vdot(force, steps.moving[2]) + deviation @ pulled)
        factor = factorise(band.reshape(-1, 3).T, border.ravel(), float(corner))
        return Normal(factor, states.ravel(), float(push), misfit)

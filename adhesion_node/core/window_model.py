"""A window as a least-squares problem in its trajectory and in kappa, where the adhesion is mu(v) = kappa law(v)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .adhesion import SpeedLaw
from .banded import Factor, factorise
from .motion import Motion
from .train import GRAVITY, Array
from .window import Window


class Belief(NamedTuple):
    """Gaussian law of position, m, speed, m/s, and a third quantity, kappa or mu: mean (3,), covariance (3, 3)."""

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
            return 0.5 * float(np.sum(squared))
        return 0.5 * (self.tail_dof + 1.0) * float(np.sum(np.log1p(squared / self.tail_dof)))


class Steps(NamedTuple):
    """The steps of a window about a trajectory; every array has shape (K,).

    x' = f + F dx + G dkappa with F = [[1, half], [0, kept]] and G = effect (dt/2, 1).
    """

    half: Array
    kept: Array
    effect: Array
    """-g T law(v): what kappa does to the speed, were it only for the adhesion."""
    headroom: Array
    """kappa at which the brake begins to limit, less the present kappa."""
    position_error: Array
    speed_error: Array
    """The trajectory's deviations from its own steps."""


class Normal(NamedTuple):
    """Normal equations at some trajectory and kappa: factorised curvature of -ln p, and minus its gradient."""

    factor: Factor
    states: Array
    """Shape (2K + 2,)."""
    kappa: float

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
    def precision(self) -> Array:
        """Inverse of the prior's covariance, shape (3, 3)."""
        return np.asarray(np.linalg.inv(self.prior.covariance), dtype=np.float64)

    @cached_property
    def certainty(self) -> tuple[Array, Array]:
        """Inverse variances of the process noise of position and speed, each of shape (K,)."""
        var_s, var_v = self.model.motion.noise(self.window.dt_s)
        return np.asarray(1.0 / var_s), np.asarray(1.0 / var_v)

    def squared(self, trajectory: Array, shift: float | Array = 0.0) -> Array:
        """Squared deviations of the measured positions, less their shift, from the trajectory, in variances: (K,)."""
        result: Array = (self.window.position_m - shift - trajectory[1:, 0]) ** 2 / self.window.variance_m2
        return result

    def linearise(self, trajectory: Array, kappa: float) -> Steps:
        """Linearise the steps about the trajectory, shape (K + 1, 2), at kappa."""
        motion, window, law = self.model.motion, self.window, self.model.law
        position, speed = trajectory[:-1, 0], trajectory[:-1, 1]
        dt, adhesion = window.dt_s, law(speed)
        resistance = motion.resistance(position, speed)
        limit = motion.train.used_adhesion(np.inf, window.brake, resistance)
        used = np.minimum(kappa * adhesion, limit)
        free = used < limit
        # while the brake limits, part of the resistance goes into the rotating masses
        resisting = np.where(free, 1.0, 1.0 / (1.0 + motion.train.rotating_mass_fraction))
        slope = np.where(free, kappa * law.slope(speed), 0.0) + resisting * motion.train.resistance_slope(speed)
        kept = 1.0 - GRAVITY * dt * slope
        next_speed = speed - GRAVITY * dt * (used + resistance)
        return Steps(
            half=0.5 * dt * (1.0 + kept),
            kept=kept,
            effect=-GRAVITY * dt * adhesion,
            headroom=limit / adhesion - kappa,
            position_error=trajectory[1:, 0] - position - 0.5 * dt * (speed + next_speed),
            speed_error=trajectory[1:, 1] - next_speed,
        )

    def normal(self, steps: Steps, trajectory: Array, kappa: float, weights: Array, margin: float = 0.0) -> Normal:
        """Assemble and factorise the normal equations at the trajectory and kappa about which `steps` are.

        Steps with less headroom than `margin` do not depend on kappa: there the brake limits, or might.
        """
        window, precision, (ps, pv) = self.window, self.precision, self.certainty
        half, kept = steps.half, steps.kept
        seen_s, seen_v = weights / window.variance_m2, 1.0 / window.speed_variance
        before, after, own, pull = (part * (steps.headroom > margin) for part in self.effects(steps))

        band = np.zeros((3, trajectory.size), order="F")
        border, states = np.zeros_like(trajectory), np.zeros_like(trajectory)
        band[0, 2::2] = ps + seen_s
        band[0, 3::2] = pv + seen_v
        band[0, :-2:2] += ps
        band[0, 1:-2:2] += ps * half**2 + pv * kept**2
        band[1, :-2:2] = ps * half
        band[1, 1:-2:2] = -ps * half
        band[2, :-2:2] = -ps
        band[2, 1:-2:2] = -pv * kept
        band[0, 0] += precision[0, 0]
        band[0, 1] += precision[1, 1]
        band[1, 0] += precision[0, 1]

        border[:-1] = before.T
        border[1:] += after.T
        border[0] += precision[:2, 2]
        corner = precision[2, 2] + float(np.sum(own))

        deviation = self.prior.mean - np.array([trajectory[0, 0], trajectory[0, 1], kappa])
        force_s, force_v = ps * steps.position_error, pv * steps.speed_error
        states[:-1, 0] = force_s
        states[:-1, 1] = half * force_s + kept * force_v
        states[1:, 0] += seen_s * (window.position_m - trajectory[1:, 0]) - force_s
        states[1:, 1] += seen_v * (window.speed_mps - trajectory[1:, 1]) - force_v
        states[0] += precision[:2] @ deviation
        push = float(precision[2] @ deviation) + float(np.sum(pull))
        return Normal(factorise(band, border.ravel(), corner), states.ravel(), push)

    def effects(self, steps: Steps) -> tuple[Array, Array, Array, Array]:
        """What every step adds to the normal equations if it depends on kappa.

        To the border at the states before and after it, each of shape (2, K); to the corner and to the gradient,
        each of shape (K,).
        """
        (ps, pv), effect, half_dt = self.certainty, steps.effect, 0.5 * self.window.dt_s
        to_s, to_v = half_dt * effect * ps, effect * pv
        return (
            np.array([to_s, steps.half * to_s + steps.kept * to_v]),
            np.array([-to_s, -to_v]),
            effect * (half_dt * to_s + to_v),
            to_s * steps.position_error + to_v * steps.speed_error,
        )

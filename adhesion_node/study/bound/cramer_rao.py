# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Posterior Cramér-Rao bound: how well any estimator can know mu from noisy positions of a braking train.

The unknowns are the state (s, v) and the rail condition kappa in mu = kappa law(v), the law being known. With J_k
their information at sample k, A_k the step's Jacobian and Q the covariance of its noise, the information of the
unknowns at k and of the next state together is

    diag(J_k, 0) + E[(A_k, -1)' Q^-1 (A_k, -1)]

from which the old state is eliminated and to which the next position adds 1/r: the recursion of
Tichavský, Muravchik and Nehorai (IEEE Trans. Signal Processing 46, 1998) with kappa as an unknown that no noise
moves within a step. The expectation is the mean over the given trajectories. Those of one braking differ little; of
trajectories that differ much, as on both sides of the kink, the bound still holds but nobody reaches it.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ...core.physics.adhesion import AdhesionLaw
from ...core.physics.motion import Motion
from ...core.physics.train import Array

MEAN_OF_STD = math.sqrt(2.0 / math.pi)
"""Mean of ``|error|`` of a Gaussian error over its standard deviation."""

SPEED_STEP_MPS, CONDITION_STEP = 1e-3, 1e-4
"""Half widths of the central differences; the model is smooth in v and, between its kinks, linear in kappa."""


class Path(NamedTuple):
    """True trajectories of R runs at the K + 1 times of the samples; the arrays broadcast to (R, K + 1)."""

    t_s: Array
    position_m: Array
    speed_mps: Array
    brake: Array
    """B/(M g) from each sample on. 0: traction holds the speed, up to the process noise."""


class Start(NamedTuple):
    """Standard deviations of the unknowns at the first sample, which holds that sample's position."""

    position_m: float
    speed_mps: float
    condition: float


class Bound(NamedTuple):
    """Least standard deviations at each of the K + 1 samples, and what they are set against; shape (K + 1,)."""

    t_s: Array
    lost_mps: Array
    """Mean speed lost since the brake was applied."""
    position_std_m: Array
    speed_std_mps: Array
    condition_std: Array
    mu_std: Array
    mu_relative_std: Array


def bound(
    motion: Motion, law: AdhesionLaw, path: Path, variance_m2: float, start: Start, condition: float = 1.0
) -> Bound:
    """Bound along trajectories on a rail of `condition` times `law`, positions measured with `variance_m2`.

    Where the brake limits or is off, nothing is learnt of the condition.
    """
    path = Path(np.asarray(path.t_s), *np.broadcast_arrays(*(np.atleast_2d(column) for column in path[1:])))
    steps = _step_information(motion, path, _jacobians(motion, law, path, condition))
    information = np.empty((path.t_s.size, 3, 3))
    information[0] = np.diag([std**-2.0 for std in start])
    for k, joint in enumerate(steps):
        joint[np.ix_([0, 1, 4], [0, 1, 4])] += information[k]
        following = joint[2:, 2:] - joint[2:, :2] @ np.linalg.solve(joint[:2, :2], joint[:2, 2:])
        following[0, 0] += 1.0 / variance_m2
        information[k + 1] = following
    return _bound(law, path, condition, np.asarray(np.linalg.inv(information)))


def speed_lost(found: Bound, relative_std: float) -> float:
    """Speed, m/s, that the train has lost when the relative bound on mu falls below a value for good; inf if never."""
    above = np.flatnonzero(found.mu_relative_std >= relative_std)
    since = int(above[-1]) + 1 if above.size else 0
    return float(found.lost_mps[since]) if since < found.lost_mps.size else math.inf


def std_that_stays_within(error: float, share: float) -> float:
    """Standard deviation from which on the error of an estimator at the bound stays within `error` in so many runs.

    At the bound the error at t is uncorrelated with what was learnt before, cov(e_t, e_u) = P_u for t < u: run
    backwards it is a Brownian motion in its own variance P. So the share of runs whose error stays within +-a from
    now on is that of the Brownian motions that have not left +-a at "time" P, a known series.

    >>> [round(std_that_stays_within(5.0, share), 2) for share in (0.5, 0.95)]
    [4.35, 2.23]
    """
    odd = np.arange(1.0, 400.0, 2.0)
    signs = np.where(odd % 4 == 1, 1.0, -1.0)

    def excess(ratio: float) -> float:
        return float(4.0 / math.pi * np.sum(signs / odd * np.exp(-((odd * math.pi * ratio) ** 2) / 8.0))) - share

    return error * float(brentq(excess, 0.05, 5.0))


def _jacobians(motion: Motion, law: AdhesionLaw, path: Path, condition: float) -> Array:
    """Derivative of the next (s, v) with respect to (s, v, kappa), the track held fixed; shape (K, R, 2, 3)."""
    dt_s = np.diff(path.t_s)
    position, speed, brake = (column[:, :-1] for column in path[1:])

    def slope(dv: float, dkappa: float) -> Array:
        """Central difference of the step over +-(dv, dkappa), shape (2, R, K)."""
        low, high = (
            np.stack(motion.advance(position, v, dt_s, brake, kappa * law(v)))
            for v, kappa in ((speed - dv, condition - dkappa), (speed + dv, condition + dkappa))
        )
        return np.asarray(high - low) / (2.0 * (dv + dkappa))

    jacobians = np.zeros((*position.T.shape, 2, 3))
    jacobians[..., 0, 0] = 1.0
    braked = (brake > 0.0).T[..., None]
    coasting = np.stack([np.broadcast_to(dt_s[:, None], position.T.shape), np.ones(position.T.shape)], axis=-1)
    jacobians[..., 1] = np.where(braked, slope(SPEED_STEP_MPS, 0.0).T, coasting)
    jacobians[..., 2] = np.where(braked, slope(0.0, CONDITION_STEP).T, 0.0)
    return jacobians


def _step_information(motion: Motion, path: Path, jacobians: Array) -> Array:
    """Mean information that each step puts between the unknowns (s, v, s', v', kappa), shape (K, 5, 5)."""
    to_next = np.broadcast_to(-np.eye(2), (*jacobians.shape[:2], 2, 2))
    deviation = np.concatenate([jacobians[..., :2], to_next, jacobians[..., 2:]], axis=-1)
    variances = np.stack([np.asarray(v) for v in motion.noise(np.diff(path.t_s))], axis=-1)
    precision = 1.0 / (variances * jacobians.shape[1])
    return np.asarray(np.einsum("krni,kn,krnj->kij", deviation, precision, deviation))


def _bound(law: AdhesionLaw, path: Path, condition: float, covariance: Array) -> Bound:
    speed = path.speed_mps
    adhesion = law(speed)
    slope = (law(speed + SPEED_STEP_MPS) - law(speed - SPEED_STEP_MPS)) / (2.0 * SPEED_STEP_MPS)
    onset = int(np.argmax((path.brake > 0.0).any(axis=0)))
    mean_speed = speed.mean(axis=0)
    stds = np.sqrt(np.einsum("kii->ki", covariance))

    def std(by_speed: Array, by_condition: Array) -> Array:
        """Of a function of (v, kappa) by the mean of its gradient over the trajectories."""
        gradient = np.stack([by_speed.mean(axis=0), by_condition.mean(axis=0)], axis=-1)
        return np.asarray(np.sqrt(np.einsum("ki,kij,kj->k", gradient, covariance[:, 1:, 1:], gradient)))

    return Bound(
        t_s=path.t_s,
        lost_mps=mean_speed[onset] - mean_speed,
        position_std_m=stds[:, 0],
        speed_std_mps=stds[:, 1],
        condition_std=stds[:, 2],
        mu_std=std(condition * slope, adhesion),
        mu_relative_std=std(slope / adhesion, np.full_like(speed, 1.0 / condition)),
    )

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A window as a least-squares problem in its trajectory and in kappa, where the adhesion is mu(v) = kappa law(v)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...belief.window import Window
from ...physics.adhesion import SpeedLaw
from ...physics.motion import Motion
from ...physics.train import Array
from ..kernels import equation

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

    def log_peak(self, variances: Array) -> float:
        """ln p of measurements without deviation, by their variances: the constant that `equation` leaves out."""
        scale = -0.5 * float(np.log(variances).sum())
        if self.tail_dof == 0.0:
            return scale - 0.5 * LOG_2PI * variances.size
        half = 0.5 * self.tail_dof
        return scale + variances.size * (
            math.lgamma(half + 0.5) - math.lgamma(half) - 0.5 * math.log(2.0 * math.pi * half)
        )


@dataclass(frozen=True)
class Problem:
    """A window, the law of its first state and of kappa, and the model of both."""

    model: Model
    window: Window
    prior: Belief

    @cached_property
    def given(self) -> equation.Given:
        """What the compiled loops need to know."""
        motion, law, window = self.model.motion, self.model.law, self.window
        breaks, levels = motion.track.steps
        return equation.Given(
            rotating=float(motion.train.rotating_mass_fraction),
            noise_m=float(motion.position_noise_rate),
            noise_mps=float(motion.speed_noise_rate),
            tail_dof=float(self.model.tail_dof),
            resistance=np.array(motion.train.resistance_si),
            law=np.array((law.floor, law.gain_kmh, law.offset_kmh, law.scale)),
            breaks=breaks,
            levels=levels,
            window=np.array(
                (
                    *(window.dt_s, window.brake, window.position_m, window.variance_m2),
                    *(window.speed_mps, window.speed_variance),
                )
            ),
            mean=np.ascontiguousarray(self.prior.mean),
            covariance=np.ascontiguousarray(self.prior.covariance),
        )

    @cached_property
    def certainty(self) -> Array:
        """Inverse variances of the process noise of position and speed, shape (2, K)."""
        return 1.0 / np.array(self.model.motion.noise(self.window.dt_s))

    @property
    def log_constant(self) -> float:
        """What all hypotheses share of ln p(y), and so `Posterior.log_evidence` leaves out."""
        window = self.window
        speeds = window.speed_variance[np.isfinite(window.speed_variance)]
        gaussian = 0.5 * float(np.log(self.certainty).sum()) - 0.5 * float((np.log(speeds) + LOG_2PI).sum())
        return gaussian + self.model.log_peak(window.variance_m2)

    def squared(self, trajectory: Array, shift: float | Array = 0.0) -> Array:
        """Squared deviations of the measured positions, less their shift, from the trajectory, in variances: (K,)."""
        result: Array = (self.window.position_m - shift - trajectory[1:, 0]) ** 2 / self.window.variance_m2
        return result

    def solved(self, trajectory: Array, kappa: float, weights: Array, margin: float = 0.0) -> equation.Solved:
        """The normal equation at the trajectory, shape (K + 1, 2), and kappa, factorised and solved.

        Steps with less headroom than `margin` do not depend on kappa: there the brake limits, or might.
        """
        found = equation.solved(self.given, trajectory, float(kappa), weights, margin)
        self.check(found.failed)
        return found

    def check(self, failed: int) -> None:
        """Raise numpy.linalg.LinAlgError where `equation` has failed."""
        if failed < 0:
            raise np.linalg.LinAlgError(f"the prior's covariance {self.prior.covariance} is not positive definite")
        if failed:
            size = 2 * self.window.steps + 2
            raise np.linalg.LinAlgError(f"the window's system is not positive definite at {failed} of {size}")

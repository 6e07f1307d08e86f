# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the bank believes: under each hypothesis a Gaussian over train, rail and sensors, and its probability."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.train import Array
from ..quick import quick
from .kernels import uniting, weighing

Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

POSITION, SPEED, MU, ROUGH, BRAKE, GRADE, OFFSET, BIAS, PITCH, SCALE, RADIUS = range(11)
"""Components of the state: position s, m; speed v, m/s; adhesion mu of the rail at that speed, or in free motion the
net deceleration over g; roughness of the rail here, relative; true over expected brake force; grade that the profile
leaves open, with the error of the resistance; slow error of the positions, m; bias of the accelerometer over g; its
pitch per deceleration over g; scale error of the speeds;
by how much the rims are too fast, relative, as the wheels' radii are not known."""

SIZE = 11


@quick
class Bank(NamedTuple):
    """Beliefs under H hypotheses. The arrays are not changed in place once a bank is made."""

    mean: Array
    """Shape (H, SIZE)."""
    covariance: Array
    """Shape (H, SIZE, SIZE)."""
    log_weight: Array
    """Logarithms of the probabilities, shape (H,) as the following."""
    noise: Indices
    """How the positions err: index into `NOISES`."""
    law: Indices
    """How adhesion depends on speed: index into the laws of the configuration."""
    kind: Indices
    """What limits the motion: index into `KINDS`."""
    born_s: Array
    """When the hypothesis says that this began; -inf: with the braking."""
    changed_s: Array
    """When it says that the rail changed last."""

    @property
    def weight(self) -> Array:
        """Probabilities."""
        result: Array = np.exp(self.log_weight)
        return result

    def is_sound(self) -> bool:
        """Whether every number is finite and no variance below 0."""
        return weighing.is_sound(*self[:3])

    def believing(self, mean: Array, covariance: Array, log_weight: Array) -> Bank:
        """With these beliefs and weights under the same labels."""
        return Bank(mean, covariance, log_weight, *self[3:])

    def normalised(self, least: float = -math.inf) -> Bank:
        """With probabilities that sum to 1, the logarithm of each no less than `least`."""
        return self.believing(self.mean, self.covariance, weighing.normalised(self.log_weight, least))

    def part(self, chosen: Mask | Indices) -> Bank:
        """A copy of the chosen hypotheses, with the weights that they have."""
        return Bank._make(column[chosen] for column in self)

    def moments(self, size: int = SIZE) -> tuple[Array, Array]:
        """Mean and covariance of the first components over all hypotheses, shapes (size,) and (size, size)."""
        return uniting.moments(self.log_weight, self.mean, self.covariance, size)

    def mean_of(self, component: int) -> float:
        """Mean of one component over all hypotheses."""
        return uniting.mean_of(self.log_weight, self.mean, component)

    def std_of(self, component: int) -> float:
        """Standard deviation of one component over all hypotheses."""
        return math.sqrt(self.moments(component + 1)[1][component, component])

    def with_fresh(self, component: int, mean: float | Array, std: float | Array) -> Bank:
        """With a component that is known anew, apart from all others."""
        means, covariance = self.mean.copy(), self.covariance.copy()
        means[:, component] = mean
        covariance[:, component, :] = covariance[:, :, component] = 0.0
        covariance[:, component, component] = np.square(std)
        return self._replace(mean=means, covariance=covariance)

    def labelled(self, kind: int | Indices, law: int | Indices, born_s: float, log_prior: float | Array) -> Bank:
        """As hypotheses of another label, their weights times a prior probability."""
        size = self.log_weight.size
        return self._replace(
            log_weight=self.log_weight + log_prior,
            law=np.full(size, law),
            kind=np.full(size, kind),
            born_s=np.full(size, born_s),
        )


def joined(banks: Iterable[Bank]) -> Bank:
    """All hypotheses of the banks."""
    return Bank._make(np.concatenate(columns) for columns in zip(*banks, strict=True))

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A window of braking: the measurements after the sample that its prior already counted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..physics.train import Array


class WindowSample(NamedTuple):
    """One accepted measurement as the window keeps it; `brake` is B/(M g), `speed_variance` inf without a speed."""

    t_ns: int
    brake: float
    position_m: float
    variance_m2: float
    speed_mps: float
    speed_variance: float
    wheel_mps: float = math.nan
    """Speed of the median wheel's rim; NaN where none was measured."""


@dataclass(frozen=True)
class Window:
    """K steps and the measurement at the end of each; every array has shape (K,)."""

    dt_s: Array
    brake: Array
    """B/(M g) during the step."""
    position_m: Array
    variance_m2: Array
    speed_mps: Array
    speed_variance: Array
    """Infinite where no speed was measured."""

    @property
    def steps(self) -> int:
        """Number of steps K."""
        return int(self.dt_s.size)

    def beginning(self, count: int) -> Window:
        """The first `count` steps."""
        return Window(*(getattr(self, each.name)[:count] for each in fields(self)))

    @cached_property
    def measured(self) -> Array:
        """Measured positions and speeds, shape (K, 2)."""
        return np.stack((self.position_m, self.speed_mps), axis=1)

    @cached_property
    def information(self) -> Array:
        """Their inverse variances, shape (K, 2); 0 where no speed was measured."""
        return 1.0 / np.stack((self.variance_m2, self.speed_variance), axis=1)


def window_of(samples: Sequence[WindowSample], noise: float = 1.0) -> Window:
    """Build the window that starts at the first sample: K + 1 samples make K steps.

    The first sample gives its time and its brake; its position belongs to the prior. The brake of a step is the
    one measured at its start. `noise` is a factor on the variances of the positions.
    """
    t_ns = np.array([sample.t_ns for sample in samples], dtype=np.int64)
    columns = np.array([sample[1:6] for sample in samples], dtype=np.float64).T
    brake, position, variance, speed, speed_variance = columns
    return Window(np.diff(t_ns) * 1e-9, brake[:-1], position[1:], noise * variance[1:], speed[1:], speed_variance[1:])

"""A window of braking: the measurements after the sample that its prior already counted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .train import Array


class Sample(NamedTuple):
    """One accepted measurement as the window keeps it; `brake` is B/(M g), `speed_variance` inf without a speed."""

    t_ns: int
    brake: float
    position_m: float
    variance_m2: float
    speed_mps: float
    speed_variance: float


Observation = tuple[int, float, float]
"""Index of the observed state (0 position, 1 speed), value and variance."""


class Window(NamedTuple):
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

    def observations(self, k: int) -> list[Observation]:
        """What was measured at the end of step `k`: the position, and the speed where there is one."""
        observed = [(0, float(self.position_m[k]), float(self.variance_m2[k]))]
        if np.isfinite(self.speed_variance[k]):
            observed.append((1, float(self.speed_mps[k]), float(self.speed_variance[k])))
        return observed


def window_of(samples: Sequence[Sample]) -> Window:
    """Build the window that starts at the first sample: K + 1 samples make K steps.

    The first sample gives its time and its brake; its position belongs to the prior. The brake of a step is the
    one measured at its start.
    """
    t_ns = np.array([sample.t_ns for sample in samples], dtype=np.int64)
    columns = np.array([sample[1:] for sample in samples], dtype=np.float64).T
    brake, position, variance, speed, speed_variance = columns
    return Window(np.diff(t_ns) * 1e-9, brake[:-1], position[1:], variance[1:], speed[1:], speed_variance[1:])

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Windows of R runs side by side, all of K steps; the live estimator is R = 1.

Arrays of this package that carry a time have it first, then the axis of runs, then that of particles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...belief.gaussian import Gaussian
from ...belief.window import Window
from ...physics.train import Array

Indices = NDArray[np.intp]

BY_STEP = ("dt_s", "brake", "position_m", "variance_m2", "speed_mps", "speed_variance")


class Windows(NamedTuple):
    """Windows with the beliefs of their first states; per step as in `Window`, with shape (K, R, 1)."""

    mean: Array
    """Of the first states, (R, 2)."""
    covariance: Array
    """Of the first states, (R, 2, 2)."""
    log_constant: Array
    """The parts of ln p(y|x) that do not depend on x, summed over each window, (R,)."""
    dt_s: Array
    brake: Array
    position_m: Array
    variance_m2: Array
    speed_mps: Array
    speed_variance: Array

    def of(self, runs: Indices) -> Windows:
        """Those of some runs."""
        mean, covariance, log_constant, *by_step = self
        return Windows(mean[runs], covariance[runs], log_constant[runs], *(column[:, runs] for column in by_step))


def stack(priors: Sequence[Gaussian], windows: Sequence[Window]) -> Windows:
    """Put windows side by side. Raises ValueError where their numbers of steps differ."""
    if len({window.steps for window in windows}) != 1:
        raise ValueError(f"windows of {[window.steps for window in windows]} steps: stack those of equal length")
    columns = {name: np.stack([getattr(window, name) for window in windows], axis=1)[..., None] for name in BY_STEP}
    variances = np.stack([np.concatenate((window.variance_m2, window.speed_variance)) for window in windows])
    logs = np.log(2.0 * math.pi * variances, out=np.zeros_like(variances), where=np.isfinite(variances))
    return Windows(
        mean=np.stack([prior.mean for prior in priors]),
        covariance=np.stack([prior.covariance for prior in priors]),
        log_constant=-0.5 * logs.sum(axis=1),
        **columns,
    )

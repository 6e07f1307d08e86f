# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Quantiles of mixtures of Gaussians."""

import math

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

Array = NDArray[np.float64]


@kernel
def quantiles(weights: Array, means: Array, stds: Array, probabilities: Array) -> Array:
    """The roots of F(x) = p by Newton's steps inside a bracket that shrinks, halved where a step would leave it.

    `weights` has the shape (H,), `means` and `stds` (R, H), the result (R, P).
    """
    result = np.empty((means.shape[0], probabilities.size))
    for row in range(means.shape[0]):
        mean, std = means[row], stds[row]
        least, most = np.inf, -np.inf
        for h in range(weights.size):
            least, most = min(least, mean[h] - 8.0 * std[h]), max(most, mean[h] + 8.0 * std[h])
        for index in range(probabilities.size):
            low, high = least, most
            x = 0.5 * (low + high)
            for _ in range(60):
                below, density = 0.0, 0.0
                for h in range(weights.size):
                    z = (x - mean[h]) / std[h]
                    if z > 8.0:
                        below += weights[h]
                    elif z > -8.0:
                        below += 0.5 * weights[h] * math.erfc(-z / math.sqrt(2.0))
                        density += weights[h] / std[h] * math.exp(-0.5 * z**2)
                excess = below - probabilities[index]
                if excess < 0.0:
                    low = x
                else:
                    high = x
                step = excess * math.sqrt(2.0 * math.pi) / density if density > 0.0 else np.inf
                before, x = x, x - step
                if not low < x < high:
                    x = 0.5 * (low + high)
                if abs(x - before) <= 1e-12:
                    break
            result[row, index] = x
    return result

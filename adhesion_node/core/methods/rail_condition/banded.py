# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A window's normal equations: block-tridiagonal in its states, bordered by one parameter that all steps share.

    [ A    c ] [ dx ]   [ b ]
    [ c^T  d ] [ dp ] = [ e ]

A couples the two components of neighbouring states only, so one banded Cholesky factor gives everything: the
Gauss-Newton step, covariances, the determinant.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs, dtbtrs

from ...physics.train import Array


class Factor(NamedTuple):
    """The factorised system of K + 1 states (position, speed) and the parameter."""

    cholesky: Array
    """Lower banded factor of A, shape (3, 2K + 2)."""
    border: Array
    """c, shape (2K + 2,)."""
    solved: Array
    """A^-1 c, shape (2K + 2,)."""
    information: float
    """d - c^T A^-1 c: what is known of the parameter, the states being unknown."""

    def apply(self, right: Array) -> Array:
        """A^-1 `right`, shape (2K + 2, ...)."""
        result: Array = dpbtrs(self.cholesky, right, lower=1)[0]
        return result

    def solve(self, states: Array, parameter: float | Array) -> tuple[Array, Array]:
        """(dx, dp) of right-hand sides (b, e), shapes (2K + 2, ...) and (...)."""
        free = self.apply(states)
        moved = (parameter - self.border @ free) / self.information
        return free - np.multiply.outer(self.solved, moved), moved

    def forward(self, right: Array) -> Array:
        """L^-1 `right` with A = L L^T, shape (2K + 2, C): half of `apply`."""
        result: Array = dtbtrs(self.cholesky, right, uplo="L")[0]
        return result

    def end(self, half: Array, parameters: Array) -> Array:
        """Last state of the solutions whose right-hand sides `forward` took half way, shape (2, C)."""
        return self._root.T @ half[-2:] - np.outer(self.solved[-2:], parameters)

    def covariance_at_end(self) -> Array:
        """Covariance of the last state and the parameter, shape (3, 3)."""
        along = np.array([-self.solved[-2], -self.solved[-1], 1.0])
        covariance: Array = along[:, None] * along / self.information
        covariance[:2, :2] += self._root.T @ self._root
        return covariance

    @property
    def _root(self) -> Array:
        """Inverse of the last block of L, shape (2, 2): no state behind it takes part."""
        first, below, second = self.cholesky[0, -2], self.cholesky[1, -2], self.cholesky[0, -1]
        return np.array([[1.0 / first, 0.0], [-below / (first * second), 1.0 / second]])

    @property
    def log_determinant(self) -> float:
        """ln det of the whole matrix."""
        return float(2.0 * np.log(self.cholesky[0]).sum() + np.log(self.information))


def factorise(band: Array, border: Array, corner: float) -> Factor:
    """Factorise the system whose A stands in lower banded form, shape (3, 2K + 2).

    Raises numpy.linalg.LinAlgError when A is not positive definite.
    """
    cholesky, failed = dpbtrf(band, lower=1)
    if failed:
        raise np.linalg.LinAlgError(f"the window's system is not positive definite at {failed} of {band.shape[1]}")
    solved = dpbtrs(cholesky, border, lower=1)[0]
    return Factor(cholesky, border, solved, corner - float(border @ solved))

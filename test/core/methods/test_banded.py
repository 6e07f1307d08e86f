# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The factorised window against dense numpy matrices."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import Array

from adhesion_node.core.methods.rail_condition.banded import Factor, factorise


def _dense(states: int, seed: int) -> Array:
    """A positive definite matrix with the window's sparsity: (s, v) of neighbours coupled, bordered by one."""
    rng = np.random.default_rng(seed)
    size = 2 * states
    prior = np.zeros((3, size + 1))
    prior[:, [0, 1, -1]] = rng.standard_normal((3, 3))
    rows = [prior]
    for k in range(states):
        row = np.zeros((2, size + 1))
        row[:, 2 * k : 2 * k + 2] = np.diag(rng.uniform(0.5, 2.0, 2))
        rows.append(row)
    for k in range(states - 1):
        row = rng.standard_normal((2, size + 1))
        row[:, : 2 * k] = row[:, 2 * k + 4 : size] = 0.0
        row[0, 2 * k + 3] = row[1, 2 * k] = row[1, 2 * k + 2] = 0.0  # as the steps of (s, v): s' never enters v
        rows.append(row)
    tall = np.vstack(rows)
    return np.asarray(tall.T @ tall)


def _factor(dense: Array) -> Factor:
    size = len(dense) - 1
    band = np.zeros((3, size), order="F")
    for below in range(3):
        band[below, : size - below] = np.diag(dense[:size, :size], -below)
    return factorise(band, dense[:size, size].copy(), float(dense[size, size]))


@pytest.fixture(params=[(1, 0), (2, 1), (3, 2), (51, 3)], ids=lambda case: f"{case[0]} states")
def dense(request: pytest.FixtureRequest) -> Array:
    matrix = _dense(*request.param)
    assert np.count_nonzero(np.tril(matrix[:-1, :-1], -3)) == 0  # the band holds all of it
    return matrix


def test_solves_for_one_and_for_many_right_hand_sides(dense: Array) -> None:
    rng = np.random.default_rng(9)
    for shape in ((), (4,)):
        right = rng.standard_normal((len(dense), *shape))
        states, parameter = _factor(dense).solve(right[:-1], right[-1] if shape else float(right[-1]))
        expected = np.linalg.solve(dense, right)
        assert states == pytest.approx(expected[:-1], rel=1e-9, abs=1e-9)
        assert np.asarray(parameter) == pytest.approx(expected[-1], rel=1e-9)


def test_the_block_of_the_states_alone(dense: Array) -> None:
    right = np.random.default_rng(8).standard_normal((len(dense) - 1, 2))
    assert _factor(dense).apply(right) == pytest.approx(np.linalg.solve(dense[:-1, :-1], right), rel=1e-9, abs=1e-9)


def test_half_way_are_the_quadratic_form_and_the_end(dense: Array) -> None:
    rng, factor = np.random.default_rng(7), _factor(dense)
    right, parameters = rng.standard_normal((len(dense) - 1, 4)), rng.standard_normal(4)
    half = factor.forward(right)
    assert half.T @ half == pytest.approx(right.T @ np.linalg.solve(dense[:-1, :-1], right), rel=1e-9, abs=1e-9)
    moved, parameter = factor.solve(right, parameters)
    assert factor.end(half, parameter) == pytest.approx(moved[-2:], rel=1e-9, abs=1e-9)


def test_law_at_the_end_is_the_corner_of_the_inverse(dense: Array) -> None:
    factor, inverse = _factor(dense), np.linalg.inv(dense)
    assert factor.covariance_at_end() == pytest.approx(inverse[-3:, -3:], rel=1e-9, abs=1e-12)
    assert factor.information == pytest.approx(1.0 / inverse[-1, -1])


def test_log_determinant(dense: Array) -> None:
    assert _factor(dense).log_determinant == pytest.approx(np.linalg.slogdet(dense)[1])


def test_refuses_what_is_not_positive_definite() -> None:
    dense = _dense(4, 0)
    dense[5, 5] = -1.0
    with pytest.raises(np.linalg.LinAlgError, match=r"the window's system is not positive definite at 6 of 8"):
        _factor(dense)

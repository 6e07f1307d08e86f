# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The linearised window as a factor graph of GTSAM (F. Dellaert): built in Python, eliminated in C++."""

from typing import Any

import gtsam
import numpy as np

from ...core.methods.kernels import equation
from ...core.methods.rail_condition.problem import Problem
from ...core.physics.train import Array


def built(problem: Problem, solved: equation.Solved, trajectory: Array, kappa: float) -> Any:
    """The graph of the steps that `solved` linearised about the trajectory and kappa, whitened."""
    graph, window, unit = gtsam.GaussianFactorGraph(), problem.window, gtsam.noiseModel.Unit.Create
    last, root = window.steps + 1, np.linalg.cholesky(np.linalg.inv(problem.prior.covariance)).T
    off = root @ (problem.prior.mean - np.array([*trajectory[0], kappa]))
    graph.add(gtsam.JacobianFactor(0, root[:, :2], last, root[:, 2:], off, unit(3)))
    sure, seen = np.sqrt(problem.certainty), 1.0 / np.sqrt(window.variance_m2)
    for k, (half, kept, effect_s, effect, error_s, error, headroom) in enumerate(solved.steps):
        free, by = float(headroom > 0.0), sure[:, k]
        before = np.array([[by[0], by[0] * half], [0.0, by[1] * kept]])
        shared = np.array([[by[0] * effect_s * free], [by[1] * effect * free]])
        deviation = by * np.array([error_s, error])
        graph.add(gtsam.JacobianFactor(k, before, k + 1, -np.diag(by), last, shared, deviation, unit(2)))
        measured = np.array([seen[k] * (window.position_m[k] - trajectory[k + 1, 0])])
        graph.add(gtsam.JacobianFactor(k + 1, np.array([[seen[k], 0.0]]), measured, unit(1)))
    return graph


def change(graph: Any, steps: int) -> float:
    """Eliminate; the step of kappa."""
    return float(graph.optimize().at(steps + 1)[0])

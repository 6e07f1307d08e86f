# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The shapes of the adhesion over speed: the same knowledge of mu in each, weights, drift."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.methods.rail_condition.hypotheses import (
    Hypothesis,
    hypotheses,
    probabilities,
    scaled,
    widened,
    with_rail,
)
from adhesion_node.core.methods.rail_condition.problem import Belief
from adhesion_node.core.physics.adhesion import SNOW, WET

BELIEF = Belief(
    np.array([100.0, 70.0, 0.06]), np.array([[0.04, 0.005, 1e-4], [0.005, 0.01, -2e-4], [1e-4, -2e-4, 1.6e-5]])
)
"""Of (s, v, mu)."""


def test_every_shape_knows_the_same_of_mu() -> None:
    shapes = hypotheses(WET, SNOW, 0.9, BELIEF)
    assert [shape.law for shape in shapes[:2]] == [WET, SNOW]
    assert shapes[2].law.gain_kmh == 0.0
    for shape in shapes:
        assert shape.mu == pytest.approx(0.06)
        assert shape.belief.mean[:2].tolist() == [100.0, 70.0]
        assert np.array_equal(shape.belief.covariance[:2, :2], BELIEF.covariance[:2, :2])
        factor = float(shape.law(np.array(70.0)))
        assert shape.belief.covariance[2, :2] * factor == pytest.approx(BELIEF.covariance[2, :2])
        assert shape.belief.covariance[2, 2] * factor**2 == pytest.approx(1.6e-5)
    # kappa of the wet law, 0.04 + 13.7/(120 + 252)
    assert shapes[0].belief.mean[2] == pytest.approx(0.06 / 0.0768280, rel=1e-6)


def test_weights_of_the_shapes() -> None:
    assert probabilities(hypotheses(WET, SNOW, 0.9, BELIEF)) == pytest.approx([0.9, 0.05, 0.05])
    assert probabilities(hypotheses(WET, SNOW, 1.0, BELIEF)) == pytest.approx([1.0])  # what is impossible is left out
    assert hypotheses(WET, SNOW, 0.0, BELIEF)[0].law is SNOW
    assert probabilities(hypotheses(WET, SNOW, 0.0, BELIEF)) == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize("shift", [0.0, -1e5, 1e5])
def test_probabilities_survive_any_common_evidence(shift: float) -> None:
    shapes = [Hypothesis(WET, BELIEF, shift + math.log(weight)) for weight in (1.0, 3.0, 4.0)]
    assert probabilities(shapes) == pytest.approx([0.125, 0.375, 0.5])


def test_variance_of_mu_by_drawing() -> None:
    kappa = scaled(BELIEF, 1.0 / float(WET(np.array(70.0))))
    spread = kappa.covariance.copy()
    spread[1, 1] = 4.0  # a speed so uncertain that the law's slope tells
    shape = Hypothesis(WET, Belief(kappa.mean, spread), 0.0)
    _, v, factor = np.random.default_rng(0).multivariate_normal(shape.belief.mean, spread, 200_000).T
    assert shape.variance == pytest.approx(float(np.var(factor * (0.04 + 13.7 / (120.0 + 3.6 * v)))), rel=0.02)
    assert shape.variance != pytest.approx(1.6e-5, rel=0.02)


def test_scaling_there_and_back() -> None:
    by_hand = scaled(BELIEF, 10.0)
    assert by_hand.mean.tolist() == [100.0, 70.0, 0.6]
    assert by_hand.covariance[2] == pytest.approx([1e-3, -2e-3, 1.6e-3])
    assert by_hand.covariance == pytest.approx(by_hand.covariance.T)
    back = scaled(by_hand, 0.1)
    assert back.covariance == pytest.approx(BELIEF.covariance)


def test_one_component_is_widened_and_the_rest_left() -> None:
    later = widened(BELIEF, 2, 0.01 * 0.06**2)
    assert later.covariance[2, 2] == pytest.approx(1.6e-5 + 0.01 * 0.06**2)
    assert np.array_equal(later.mean, BELIEF.mean)
    later.covariance[2, 2] = BELIEF.covariance[2, 2]
    assert np.array_equal(later.covariance, BELIEF.covariance)


def test_a_rail_that_the_state_tells_nothing_of() -> None:
    belief = with_rail(Gaussian(BELIEF.mean[:2], BELIEF.covariance[:2, :2]), Rail(0.05, 0.04, 0.03))
    assert belief.mean.tolist() == [100.0, 70.0, 0.05]
    assert belief.covariance[2].tolist() == [0.0, 0.0, 0.04**2]
    assert np.array_equal(belief.covariance[:2, :2], BELIEF.covariance[:2, :2])

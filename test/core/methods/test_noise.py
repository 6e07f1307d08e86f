# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Measurement noise identified by EM: the factor finds the true variance, and stays where the given one is right."""

from __future__ import annotations

import numpy as np
import pytest
from windowed import windowed

from adhesion_node.core import Config, Measurement, init, step
from adhesion_node.core.methods.rail_condition.method import ConditionWindow
from adhesion_node.core.methods.rail_condition.noise import Noise
from sim_node.train.run import run
from sim_node.train.scenario import find
from sim_node.train.sensors import ATMOSPHERE_PA, SensorSettings


def _identified(true_std_m: float, given_std_m: float, config: Config, seed: int = 3) -> Noise:
    """What is identified at the end of the braking of tunnel_exit."""
    state, noise = init(config, 1), Noise()
    for _, reading in run(find("tunnel_exit"), 0.1, seed, SensorSettings(position_std_m=true_std_m)):
        assert reading.position_m is not None
        gauge = max(reading.pressure_pa - ATMOSPHERE_PA, 0.0)
        state, _ = step(config, state, Measurement(reading.t_ns, reading.position_m, given_std_m**2, gauge))
        noise = state.window.noise if isinstance(state.window, ConditionWindow) else noise
    return noise


@pytest.mark.parametrize("tail_dof", [0.0, 4.0])
@pytest.mark.parametrize(("true_std_m", "given_std_m"), [(0.5, 0.5), (0.5, 0.8), (1.0, 0.6)])
def test_the_factor_goes_from_the_given_to_the_true_variance(
    true_std_m: float, given_std_m: float, tail_dof: float
) -> None:
    noise = _identified(true_std_m, given_std_m, windowed(identify_noise=True, tail_dof=tail_dof))
    assert np.sqrt(noise.factor) * given_std_m == pytest.approx(true_std_m, rel=0.2)
    assert noise.steps > 400


def test_unless_asked_the_given_variance_stands() -> None:
    assert _identified(1.0, 0.5, windowed()) == Noise()

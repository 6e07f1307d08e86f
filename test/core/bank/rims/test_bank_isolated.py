# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train on leaves with two axles of twelve whose brakes are cut out: they roll, and nothing holds them."""

from __future__ import annotations

import numpy as np
import pytest
from banks import FULL_PA, S

from adhesion_node.core.config import Config
from adhesion_node.core.estimator import init, step
from adhesion_node.core.intake.samples import Measurement, SpeedSample, WheelSample

CONFIG = Config(method="bank", speed_source="doppler")
USED, CUT_OUT, AXLES = 0.027, 2, 12


@pytest.mark.parametrize("seed", range(4))
def test_axles_that_roll_on_leaves_are_not_thought_to_hold_the_train(seed: int) -> None:
    """Braked with all that is demanded they would use 0.017 of the 0.027, and an unknown grade would hide it."""
    rng, state, speed, place = np.random.default_rng(seed), init(CONFIG, 1), 25.0, 0.0
    told: list[tuple[float, float]] = []
    for tick in range(700):
        braked_s, t_ns = 0.1 * tick - 15.0, S + tick * S // 10
        cycle = 0.12 * np.abs(np.sin(1.7 * braked_s + np.arange(AXLES))) * (np.arange(AXLES) >= CUT_OUT)
        rims = speed * (1.0 - cycle * min(max(braked_s - 1.0, 0.0), 1.0)) * (1.0 + 5e-4 * rng.standard_normal(AXLES))
        wheels = (WheelSample(t_ns, tuple((rims / CONFIG.train.wheel_radius_m).tolist())),)
        speeds = (SpeedSample(t_ns, speed + 0.08 * float(rng.standard_normal()), 0.1**2),)
        seen, pressure_pa = place + 0.3 * float(rng.standard_normal()), FULL_PA * min(max(braked_s / 2.0, 0.0), 1.0)
        measured = Measurement(t_ns, seen, 1.0, pressure_pa, speeds=speeds, wheels=wheels)
        state, estimate = step(CONFIG, state, measured)
        told += [(estimate.mu, estimate.mu_lower)] if estimate is not None and braked_s > 10.0 else []
        resisting = float(CONFIG.train.specific_resistance(speed))
        place, speed = place + 0.1 * speed, speed - 0.98 * (USED + resisting) * (braked_s > 0.0)
    mu, lower = np.array(told).T
    assert np.mean(np.abs(mu / USED - 1.0)) < 0.12
    assert np.mean(lower <= USED) > 0.95

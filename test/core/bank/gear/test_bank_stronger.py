# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train whose cylinders press with half of its brake, as an electric brake gives the rest, which nothing tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from banks import FULL, FULL_PA, S

from adhesion_node.core.config import Config
from adhesion_node.core.estimator import init, step
from adhesion_node.core.intake.samples import ImuSample, Measurement, PressureSample
from adhesion_node.core.physics.track import Grade, Track

CONFIG = Config(method="bank", track=Track((Grade(-1e4, 1e5, 0.0),)))


@pytest.mark.parametrize("kind", ["cylinder", "demanded"])
@pytest.mark.parametrize("seed", range(4))
def test_a_brake_that_no_gauge_shows_is_found_by_the_positions(seed: int, kind: str) -> None:
    """Known to a tenth for good, the brake made the speed err by 3 to 4.5 of its own deviations for 7 s more."""
    config = replace(CONFIG, pressure_kind=kind)
    rng, state, speed, place = np.random.default_rng(seed), init(config, 1), 50.0, 0.0
    off: list[float] = []
    lower: list[float] = []
    for tick in range(500):
        braked_s, t_ns = 0.1 * tick - 15.0, S + tick * S // 10
        part = min(max(braked_s / 3.0, 0.0), 1.0)
        pressure = PressureSample(t_ns, 0.5 * part * FULL_PA + 500.0 * float(rng.standard_normal()) * (part > 0.0))
        seen = place + 0.2 * float(rng.standard_normal())
        state, estimate = step(config, state, Measurement(t_ns, seen, 1.0, pressure.pressure_pa, pressures=(pressure,)))
        if estimate is not None and braked_s > 13.0:
            off.append((estimate.speed_mps - speed) / estimate.speed_std_mps)
            lower.append(estimate.mu_lower)
        resisting = float(CONFIG.train.specific_resistance(speed))
        place, speed = place + 0.1 * speed, speed - 0.98 * (part * FULL + resisting * (braked_s > 0.0))
    assert np.mean(np.abs(off) < 3.0) > 0.98
    assert np.mean(np.array(lower) <= FULL) > 0.98
    assert lower[-1] > 0.4 * FULL


@pytest.mark.parametrize("seed", range(4))
def test_an_electric_brake_is_followed_while_the_cylinders_are_nearly_empty(seed: int) -> None:
    """They show a little of it, then nothing: what the accelerometer felt was taken for its bias.

    Each time the gauge fell to nothing the braking was taken to end; mu was then what the cylinders alone press with.
    """
    rng, state, speed, place = np.random.default_rng(seed), init(CONFIG, 1), 40.0, 0.0
    off: list[float] = []
    lower: list[float] = []
    found: list[float] = []
    for tick in range(600):
        braked_s, t_ns = 0.1 * tick - 12.0, S + tick * S // 10
        used = 0.045 * min(max(braked_s / 2.0, 0.0), 1.0)
        filled = (braked_s > 0.0) * (braked_s < 20.0) * (15e3 - 15e3 * np.cos(1.5 * braked_s))
        pressure = PressureSample(t_ns, float(filled))
        slowing = 9.8 * (used + float(CONFIG.train.specific_resistance(speed)) * (braked_s > 0.0))
        felt = ImuSample(t_ns, 0.1 - slowing * 1.09 + 0.1 * float(rng.standard_normal()), 0.01)
        seen = place + 0.3 * float(rng.standard_normal())
        measured = Measurement(t_ns, seen, 4.0, pressure.pressure_pa, pressures=(pressure,), imu=(felt,))
        state, estimate = step(CONFIG, state, measured)
        if estimate is not None and braked_s > 5.0:
            off.append((estimate.speed_mps - speed) / estimate.speed_std_mps)
            lower.append(estimate.mu_lower)
            found.append(estimate.mu)
        place, speed = place + 0.1 * speed, speed - 0.1 * slowing
    assert len(off) > 80
    assert np.max(np.abs(off)) < 4.0
    assert np.mean(np.array(lower) <= 0.045) > 0.98
    assert np.array(found) == pytest.approx(0.045, rel=0.4)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Sensors that speak at another pace than ten times a second, or late."""

from __future__ import annotations

import math

import numpy as np
import pytest
from banks import FULL_PA, S
from scipy.signal import lfilter

from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.gear.axles import Axles
from adhesion_node.core.bank.layout import SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.bank.sensors.scatter import Coloured
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.estimator import init, step
from adhesion_node.core.intake.outcome import Outcome
from adhesion_node.core.intake.samples import Measurement, PressureSample, SpeedSample

CONFIG, CYLINDER = Config(method="bank"), Config(method="bank", pressure_kind="cylinder")
DOPPLER = Config(method="bank", speed_source="doppler")
RAIL = Rail(0.05, 0.04, 0.02)
MS = S // 1000


@pytest.mark.parametrize("rate_hz", [10, 50])
def test_positions_that_wander_do_so_however_often_they_come(rate_hz: int) -> None:
    """By 2 m over 30 s, declared as such; ten times a second or more often, and none is lost."""
    off: list[float] = []
    for seed in range(4):
        rng, state, keeps = np.random.default_rng(seed), init(CONFIG, 1), math.exp(-1.0 / (30.0 * rate_hz))
        noise = math.sqrt(1.0 - keeps**2) * rng.standard_normal(60 * rate_hz)
        noise[0] = rng.standard_normal()
        wander = 2.0 * lfilter([1.0], [1.0, -keeps], noise)
        for tick in range(60 * rate_hz):
            time_s = tick / rate_hz
            shown = 30.0 * time_s + wander[tick] + 0.1 * rng.standard_normal()
            state, estimate = step(CONFIG, state, Measurement(S + round(time_s * S), float(shown), 4.0, 0.0))
            if estimate is not None and time_s > 20.0:
                off.append((estimate.speed_mps - 30.0) / estimate.speed_std_mps)
        assert state.counts[Outcome.ACCEPTED] == 60 * rate_hz
    assert math.sqrt(np.mean(np.square(off))) < 1.1


def test_a_pressure_that_is_said_again_is_no_sample() -> None:
    """Of one cylinder, once a second beside ten positions: it is held low for 6 s, behind a dump."""
    memory: Memory | None = None
    for tick in range(300):
        t_ns, second = S + tick * S // 10, tick // 10
        pressure_pa = FULL_PA * (
            0.0 if second < 10 else 1.0 if second < 13 else 0.9 if second % 7 == 6 else 0.2 + 0.01 * (second % 2)
        )
        new = (PressureSample(t_ns, pressure_pa),) if tick % 10 == 0 else ()
        measured = Measurement(t_ns, 4.0 * tick, 4.0, pressure_pa, pressures=new)
        memory = met(CYLINDER, measured) if memory is None else followed(CYLINDER, memory, measured, lambda: RAIL)
        assert second < 16 or memory.brake.demanded_pa > 0.85 * FULL_PA


def test_a_speed_that_comes_late_tells_how_fast_the_train_is_now() -> None:
    """Measured 0.3 s ago: beside positions that hardly tell it, braked at 1 m/s^2."""
    rng, place, before, speed, memory = np.random.default_rng(1), 0.0, 40.0, 40.0, None
    for tick in range(250):
        t_ns, slowing = S + tick * S // 10, 1.0 if tick >= 100 else 0.0
        late = speed + 0.3 * slowing + 0.05 * rng.standard_normal()
        speeds = (SpeedSample(t_ns - 300 * MS, late, 0.05**2),)
        seen = place + 10.0 * rng.standard_normal()
        measured = Measurement(t_ns, seen, 100.0, FULL_PA if slowing else 0.0, speeds=speeds)
        memory = met(DOPPLER, measured) if memory is None else followed(DOPPLER, memory, measured, lambda: RAIL)
        place, before, speed = place + 0.1 * speed, speed, speed - 0.1 * slowing
    assert memory is not None
    mean, covariance = memory.bank.moments(2)
    assert math.sqrt(covariance[SPEED, SPEED]) < 0.15
    assert abs(mean[SPEED] - before) < 0.15


@pytest.mark.parametrize("rate_hz", [2, 3, 10])
def test_errors_that_last_are_known_of_a_speed_that_seldom_comes(rate_hz: int) -> None:
    """Of 0.2 m/s over 2 s, told as 0.05."""
    rng, keeps, speeds = np.random.default_rng(2), math.exp(-0.5 / rate_hz), Coloured()
    errors = 0.2 * lfilter([math.sqrt(1.0 - keeps**2)], [1.0, -keeps], rng.standard_normal(120 * rate_hz))
    for tick, error in enumerate(errors.tolist()):
        speeds = speeds.after(S + tick * S // rate_hz, 30.0 + error, 0.05**2, 1.0 / rate_hz, None)
    assert speeds.slow.samples >= 5


def test_wheels_that_come_through_a_crawl_turn_however_often_they_are_heard() -> None:
    axles = Axles()
    for tick in range(500):
        rims = tuple(10.0 - 0.02 * tick + 0.01 * (axle - 2) for axle in range(4))
        axles = axles.after([max(rim, 0.0) for rim in rims], S + tick * 20 * MS, 0.02 * tick, False)
        assert min(rims) <= 0.0 or axles.lying(0.02 * tick) == ()

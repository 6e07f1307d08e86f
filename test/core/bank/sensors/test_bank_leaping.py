# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A speed that leaps as no train does: a radar's over snow, a receiver's by chance."""

from __future__ import annotations

import numpy as np
import pytest
from banks import CONFIG, FULL, FULL_PA, S, bank_of, braked_run, measurements

from adhesion_node.core import Config, Measurement, SpeedSample, init, step
from adhesion_node.core.bank.labels.kinds import HELD
from adhesion_node.core.bank.layout import SCALE, SPEED
from adhesion_node.core.bank.sensors.leaping import Leaping
from adhesion_node.core.intake.outcome import Outcome
from adhesion_node.core.intake.samples import PressureSample
from adhesion_node.core.physics.train import Array

STD, NEVER = 0.1, Leaping(since_ns=0)


def _scale_std(by_mps: float, before: Leaping = NEVER, t_ns: int = 9 * S, elapsed_s: float = 0.1) -> float:
    """Of a train at 40 m/s, behind a speed that was off by so much."""
    bank = bank_of([HELD, HELD], spread=0.0).with_fresh(SPEED, 40.0, 0.01).with_fresh(SCALE, 0.0, 0.001)
    _, bank = before.after(CONFIG, bank, t_ns, elapsed_s, np.full(2, by_mps), np.full(2, STD))
    return float(np.sqrt(bank.covariance[:, SCALE, SCALE]).max())


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_speed_leaps_that_is_farther_off_than_its_errors_and_the_brake_explain(sign: float) -> None:
    braked_mps = 9.8 * FULL * 0.1
    assert _scale_std(sign * (4.0 * STD + braked_mps - 1e-3)) == pytest.approx(0.001)
    leapt_mps = 4.0 * STD + braked_mps + 1e-3
    assert _scale_std(sign * leapt_mps) == pytest.approx(np.hypot(leapt_mps / 40.0, 0.001))
    assert _scale_std(sign * 10.0, elapsed_s=1.0) == pytest.approx(0.001), "it was not heard for too long"
    for before in (Leaping(), Leaping(since_ns=7 * S)):
        assert _scale_std(sign * 10.0, before) == pytest.approx(0.001), "only just heard, the train may be the one"


def test_it_leaps_back_to_the_scale_before() -> None:
    """But not the same way again, nor by a part of it, nor long after."""
    leapt = Leaping(0.6, 9 * S, 0, (0.002, 0.005))
    assert _scale_std(-0.37, leapt, 10 * S) == pytest.approx(0.005)
    for by_mps, t_ns in ((0.37, 10 * S), (-0.35, 10 * S), (-0.37, 15 * S)):
        assert _scale_std(by_mps, leapt, t_ns) == pytest.approx(0.001)


def _told(factor: Array, seed: int) -> tuple[float, float, int]:
    """Of a wet braking by a radar that tells so many times the speed: how far the estimate was off at worst, m/s.

    And the most adhesion that the way ahead was counted on to have, and how many positions were withheld.
    """
    times, truth, places = braked_run(0.05, seed, 60.0, speed_mps=45.0)
    shown = factor * truth[:, 1] + 0.1 * np.random.default_rng(seed + 100).standard_normal(times.size)
    told, worst, most = Config(speed_source="radar"), 0.0, 0.0
    state = init(told, 1)
    for index, each in enumerate(measurements(times, places, 0.3)):
        radar = SpeedSample(each.t_ns, float(shown[index]), 0.1**2)
        state, now = step(told, state, each._replace(speeds=(radar,)))
        if now is not None and now.ahead is not None and times[index] > 12.0:
            worst, most = max(worst, abs(now.speed_mps - truth[index, 1])), max(most, *now.ahead.mu)
    return worst, most, state.counts[Outcome.SLIDING]


@pytest.mark.parametrize("off", [-0.04, 0.04, -0.1])
@pytest.mark.parametrize("seed", range(3))
def test_a_radar_whose_scale_leaps_for_15_s_is_followed(seed: int, off: float) -> None:
    """It was believed: the speed told was off by as much, positions were withheld, the way ahead was told too short."""
    factor = np.ones(600)
    factor[200:350] += off
    worst, most, withheld = _told(factor, seed)
    assert worst < 0.5
    assert most <= 0.05
    assert not withheld


@pytest.mark.parametrize("off_mps", [2.0, 5.0])
def test_speeds_that_are_off_by_chance_leave_their_scale_as_it_was(off_mps: float) -> None:
    """Of a Doppler speed alone, which nothing holds in place: the speed told walked off, outlier after outlier."""
    times, truth, _ = braked_run(0.05, 1, 300.0, speed_mps=45.0)
    truth[:, 1] = np.concatenate((np.full(2500, truth[0, 1]), truth[:500, 1]))
    shown = truth[:, 1] + 0.05 * np.random.default_rng(7).standard_normal(times.size)
    shown[130::40] += off_mps
    told, off = Config(speed_source="doppler"), list[float]()
    state = init(told, 1)
    for index in range(times.size):
        t_ns, pressure = S + index * S // 10, FULL_PA if index >= 2550 else 0.0
        doppler = SpeedSample(t_ns, float(shown[index]), 0.05**2)
        alone = Measurement(
            t_ns, np.nan, np.inf, pressure, pressures=(PressureSample(t_ns, pressure),), speeds=(doppler,)
        )
        state, now = step(told, state, alone)
        if now is not None and index > 200:
            off.append(abs(now.speed_mps - truth[index, 1]))
    assert len(off) > 300
    assert max(off) < 0.9

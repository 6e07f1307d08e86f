# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Any settings within their ranges, through a short braking: no error, only finite numbers; what fails is told."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import drive, ride
from windowed import Failing, windowed

from adhesion_node.core import Config, Outcome, Regime, finish, init, predict, step
from adhesion_node.core.intake.samples import (
    ImuSample,
    PositionSample,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from adhesion_node.core.physics.train import Train
from adhesion_node.core.setting import Setting, settings_of

MOST = {"window": 60, "particles": 20, "iterations": 20}
"""Beyond these, and above what is small, a braking takes seconds."""


def values_of(one: Setting) -> st.SearchStrategy[Any]:
    if one.choices:
        return st.sampled_from(one.choices)
    if isinstance(one.default, bool):
        return st.booleans()
    if isinstance(one.default, int):
        return st.integers(int(one.low), min(int(one.high), MOST.get(one.name, 10**9)))
    if one.low > 0.0:
        return st.floats(math.log(one.low), math.log(one.high)).map(lambda x: min(max(math.exp(x), one.low), one.high))
    return st.sampled_from([one.low, one.high]) | st.floats(one.low, one.high)


def some(kind: type[Any], without: tuple[str, ...] = ()) -> st.SearchStrategy[dict[str, Any]]:
    """Up to four settings away from their defaults, which may be at the ends of their ranges."""
    every = {one.name: values_of(one) for one in settings_of(kind) if one.name not in without}
    names = st.sets(st.sampled_from(sorted(every)), max_size=4)
    return names.flatmap(lambda chosen: st.fixed_dictionaries({name: every[name] for name in sorted(chosen)}))


def braking(period_s: float, speed_mps: float) -> Iterator[Sample]:
    """5 s of coasting and 7 s under the brake, of all sensors, some of which are silent by turns."""
    rng = np.random.default_rng(1)
    for m in ride([(5.0, 0.0), (7.0, 410e3)], 0.06, speed_mps=speed_mps, period_s=period_s):
        t_ns, v = m.t_ns + 10**9, speed_mps - 0.7 * max(m.t_ns * 1e-9 - 5.0, 0.0)
        yield PressureSample(t_ns - 4, m.brake_pressure_pa or 0.0)
        if rng.random() < 0.5:
            yield SpeedSample(t_ns - 3, v, 0.01 if t_ns % 3 else None)
            yield WheelSample(t_ns - 2, (v / 0.46, 0.9 * v / 0.46))
            yield ImuSample(t_ns - 1, -0.7 * bool(m.brake_pressure_pa), 0.01)
        yield PositionSample(t_ns, m.position_m, m.variance_m2)


@pytest.mark.parametrize(("method", "examples"), [("bank", 15), ("rail_condition", 30), ("particle_em", 20)])
def test_no_settings_within_their_ranges_end_the_estimator(method: str, examples: int) -> None:
    @settings(max_examples=examples * settings().max_examples // 60)
    @given(
        some(Config, without=("method",)),
        some(Train),
        st.sampled_from([0.1, 0.5, 1.0]),
        st.sampled_from([0.5, 15.0, 40.0, 95.0]),
    )
    def search(chosen: dict[str, Any], train: dict[str, Any], period_s: float, speed_mps: float) -> None:
        chosen = {"window": 20} | chosen
        assume(chosen.get("step", 5) < chosen["window"])
        check(Config(train=Train(**train), method=method, **chosen), braking(period_s, speed_mps))

    search()


def check(config: Config, samples: Iterator[Sample]) -> None:
    state, estimates = init(config, 1), []
    for sample in samples:
        state, estimate = step(config, state, sample)
        estimates += [] if estimate is None else [estimate]
    for estimate in (*estimates, *finish(config, state)[1]):
        assert all(math.isfinite(value) for value in estimate if isinstance(value, float)), estimate
        assert 0.0 <= estimate.mu_lower <= estimate.mu
        assert min(estimate.mu_std, estimate.position_std_m, estimate.speed_std_mps) >= 0.0
        predict(config, estimate)


@pytest.mark.parametrize("method", ["rail_condition", "particle_em"])
@pytest.mark.parametrize("period_s", [0.1, 0.5])
@pytest.mark.parametrize(
    "settings", [{"position_noise_m": 1e-6}, {"train": Train(resistance_c2=0.01)}, {"plausible_probability": 1.0}]
)
def test_settings_that_ended_a_live_node_do_so_no_more(method: str, period_s: float, settings: dict[str, Any]) -> None:
    state, estimates = drive(windowed(method=method, **settings), ride([(8.0, 0.0), (6.0, 410e3)], period_s=period_s))
    assert state.counts[Outcome.FAILED] == 0
    assert len(estimates) > 2


def test_a_resistance_that_no_train_has_is_refused() -> None:
    with pytest.raises(ValueError, match=r"train\.resistance_c2 = 0\.67: give a value from 0 to 0\.01 N/kN"):
        Train(resistance_c2=0.67)


@pytest.mark.parametrize("failure", [np.linalg.LinAlgError("singular"), OverflowError("too large"), math.nan, math.inf])
@pytest.mark.parametrize("at", [1, 8])
def test_a_window_whose_numbers_fail_is_withheld_and_counted(failure: Exception | float, at: int) -> None:
    config = windowed()
    state = init(config, 1)._replace(method=Failing(failure, at))
    told, estimates = [], []
    measurements = ride([(8.0, 0.0), (12.0, 410e3)])
    for measurement in measurements:
        state, estimate = step(config, state, measurement)
        told += [(str(event), estimate) for event in state.events]
        estimates += [] if estimate is None else [estimate]
    ((text, withheld),) = told
    assert state.counts[Outcome.FAILED] == 1
    assert "the numbers of a window failed" in text
    assert "measurements (" in text
    assert withheld is not None
    assert (withheld.regime, withheld.window) == (Regime.COASTING, 0)
    assert estimates[-1].regime is Regime.ADHESION_LIMITED, "the next window identifies again"
    assert estimates[-1].mu == pytest.approx(0.0726, abs=0.01)
    assert state.counts[Outcome.ACCEPTED] == len(measurements)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""No train that needs more way than it has left is let go on, whatever a state and its curve may be wrong by."""

from __future__ import annotations

from typing import NamedTuple

from hypothesis import assume, given
from hypothesis import strategies as st
from test_supervision import NOW_NS, constant

from adhesion_node.core.atp import ceiling
from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.atp.supervision import Level, decide


@st.composite
def configs(draw: st.DrawFn) -> SupervisionConfig:
    """Settings that a train may have."""
    warning_s = draw(st.floats(0.0, 4.0))
    return SupervisionConfig(
        target_speed_kmh=draw(st.sampled_from([0.0, 40.0, 100.0])),
        line_speed_kmh=500.0,
        emergency_build_up_s=draw(st.floats(0.0, 6.0)),
        service_build_up_s=draw(st.floats(0.0, 8.0)),
        traction_cut_off_s=draw(st.floats(0.0, 15.0)),
        warning_time_s=warning_s,
        driver_time_s=warning_s + draw(st.floats(0.0, 4.0)),
        acceleration_mps2=draw(st.floats(0.0, 1.0)),
        speed_margin_mps=draw(st.sampled_from([0.0, 0.5])),
        position_margin_m=draw(st.sampled_from([0.0, 5.0])),
        margin_sigma=draw(st.floats(0.0, 4.0)),
    )


def needed_m(config: SupervisionConfig, speed_mps: float, slowing_mps2: float) -> float:
    """Way, m, from the emergency intervention to the speed allowed at the target, by the equations of motion."""
    target = config.target_speed_mps
    foot = target + ceiling.EBI.above(target)
    cut_off = speed_mps + config.acceleration_mps2 * config.traction_s
    built_up = cut_off + min(config.acceleration_mps2, 0.4) * config.coasting_s
    pulling_m = (speed_mps + cut_off) / 2.0 * config.traction_s
    coasting_m = (cut_off + built_up) / 2.0 * config.coasting_s
    return pulling_m + coasting_m + max(built_up**2 - foot**2, 0.0) / (2.0 * slowing_mps2)


class Case(NamedTuple):
    """What is true, and by how much the state is wrong, in shares of what it may be."""

    speed_mps: float
    slowing_mps2: float
    pull: float
    """Acceleration since the stamp over A_est."""
    age_s: float
    short: float
    """Of the way that is needed, the share that is not there."""
    position_std_m: float
    speed_std_mps: float
    ahead: float
    faster: float


CASES = st.builds(
    Case,
    speed_mps=st.floats(0.0, 120.0),
    slowing_mps2=st.floats(0.2, 2.0),
    pull=st.floats(-1.0, 1.0),
    age_s=st.floats(0.0, 2.0),
    short=st.floats(1e-3, 1.0),
    position_std_m=st.floats(1e-3, 20.0),
    speed_std_mps=st.floats(1e-3, 2.0),
    ahead=st.floats(-1.0, 1.0),
    faster=st.floats(-1.0, 1.0),
)


@given(config=configs(), case=CASES)
def test_a_train_that_needs_more_way_than_it_has_left_is_braked(config: SupervisionConfig, case: Case) -> None:
    """The state is wrong by k standard deviations at most; since then the train pulls by A_est at most."""
    before = max(case.speed_mps - case.pull * config.acceleration_mps2 * case.age_s, 0.0)
    way = needed_m(config, case.speed_mps, case.slowing_mps2)
    allowed = config.target_speed_mps + ceiling.EBI.above(config.target_speed_mps)
    assume(case.speed_mps > allowed + 1e-6 and way > 1.0)
    assume(case.speed_mps - before <= config.acceleration_mps2 * case.age_s)
    place = config.target_position_m - way * (1.0 - case.short) - (before + case.speed_mps) / 2.0 * case.age_s
    stamp_ns = NOW_NS - round(case.age_s * 1e9)
    state = TrainState(
        stamp_ns,
        place + case.ahead * config.margin_sigma * case.position_std_m,
        before + case.faster * config.margin_sigma * case.speed_std_mps,
        case.position_std_m,
        case.speed_std_mps,
    )
    curve = constant(max(state.speed_mps, config.target_speed_mps), deceleration_mps2=case.slowing_mps2)
    decision = decide(config, NOW_NS, state, StampedCurve(stamp_ns, state.position_m, curve))
    assert decision.level is Level.EMERGENCY_BRAKE

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Supervision: the level by the limits, what is missing or old, and a drive that ends before the target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.atp.received import StampedCurve, TrainState, Unavailable
from adhesion_node.core.atp.supervision import Decision, Level, Severity, decide, held, measured
from adhesion_node.core.physics import braking
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.core.physics.train import CRH3, KMH

NOW_NS = 1_000_000_000_000
SECOND_NS = 1_000_000_000


def constant(first_mps: float, last_mps: float = 0.0, deceleration_mps2: float = 0.8) -> BrakingCurve:
    """Return the curve of a constant deceleration in closed form."""
    speed = np.linspace(first_mps, last_mps, 64)
    return BrakingCurve(
        distance_m=(first_mps**2 - speed**2) / (2 * deceleration_mps2),
        speed_mps=speed,
        deceleration_mps2=np.full_like(speed, deceleration_mps2),
        time_s=(first_mps - speed) / deceleration_mps2,
    )


CONFIG = SupervisionConfig(
    target_position_m=5000.0,
    target_speed_kmh=0.0,
    emergency_build_up_s=2.0,
    service_build_up_s=3.0,
    service_deceleration_mps2=5.0,
    acceleration_mps2=0.0,
    speed_margin_mps=0.0,
    position_margin_m=10.0,
)
NEEDED_M = 1000.0 + 80.0
"""40 m/s to a stand at 0.8 m/s^2: 1600/1.6 m; 2 s of build-up at 40 m/s."""
CURVE = StampedCurve(NOW_NS, 0.0, constant(40.0))


def slow(position_m: float) -> StampedCurve:
    """Return the curve of a train at 12 m/s."""
    return StampedCurve(NOW_NS, position_m, constant(12.0))


def at_margin(margin_m: float, previous: Level = Level.NORMAL) -> Decision:
    """Decide `margin_m` before the emergency intervention at 40 m/s."""
    position = 5000.0 - 10.0 - NEEDED_M - margin_m
    return decide(CONFIG, NOW_NS, TrainState(NOW_NS, position, 40.0), CURVE._replace(position_m=position), previous)


@pytest.mark.parametrize(
    ("margin_m", "level", "severity"),
    [  # at 40 m/s: T_bs = 3 s, T_warning = 2 s, T_driver = 4 s, T_indication = max(0.8 * 3, 5) + 4 = 9 s
        (641.0, Level.NORMAL, Severity.OK),
        (639.0, Level.INDICATION, Severity.OK),
        (281.0, Level.INDICATION, Severity.OK),
        (279.0, Level.OVERSPEED, Severity.WARN),
        (201.0, Level.OVERSPEED, Severity.WARN),
        (199.0, Level.WARNING, Severity.WARN),
        (121.0, Level.WARNING, Severity.WARN),
        (119.0, Level.SERVICE_BRAKE, Severity.ERROR),
        (1.0, Level.SERVICE_BRAKE, Severity.ERROR),
        (-1.0, Level.EMERGENCY_BRAKE, Severity.ERROR),
    ],
)
def test_each_level_begins_where_its_time_is_left(margin_m: float, level: Level, severity: Severity) -> None:
    decision = at_margin(margin_m)
    assert (decision.level, decision.severity, decision.message) == (level, severity, level.message)
    assert decision.reading is not None
    assert decision.reading.margin_m == pytest.approx(margin_m)
    assert decision.reading.braking_distance_m == pytest.approx(1000.0)
    assert decision.reading.distance_to_target_m == pytest.approx(10.0 + NEEDED_M + margin_m)


def test_the_published_speeds_are_those_that_decide() -> None:
    for margin in np.linspace(-200.0, 900.0, 200):
        decision = at_margin(float(margin))
        assert decision.reading is not None
        _, _, _, permitted, warning, sbi, ebi, indication, supervised = decision.reading
        assert supervised == 40.0
        assert indication <= permitted <= warning <= sbi <= ebi
        exceeded = sum(limit < 40.0 for limit in (indication, permitted, warning, sbi, ebi))
        assert decision.level is list(Level)[exceeded]


@pytest.mark.parametrize(
    ("previous", "margin_m", "level"),
    [
        (Level.SERVICE_BRAKE, 250.0, Level.SERVICE_BRAKE),
        (Level.EMERGENCY_BRAKE, 250.0, Level.EMERGENCY_BRAKE),
        (Level.WARNING, 50.0, Level.SERVICE_BRAKE),
        (Level.EMERGENCY_BRAKE, 300.0, Level.INDICATION),
        (Level.SERVICE_BRAKE, 700.0, Level.NORMAL),
    ],
)
def test_an_intervention_holds_until_the_permitted_speed_is_kept(
    previous: Level, margin_m: float, level: Level
) -> None:
    assert at_margin(margin_m, previous).level is level


def test_what_is_held_is_never_less_than_what_is_measured() -> None:
    for previous in Level:
        for margin in np.linspace(-200.0, 900.0, 100):
            reading = at_margin(float(margin)).reading
            assert reading is not None
            assert list(Level).index(held(previous, reading)) >= list(Level).index(measured(reading))


@pytest.mark.parametrize(
    ("previous", "margin_m", "level"),
    [  # 59 m of way and margin for each m/s of 40, T_indication 9 s on top
        (Level.INDICATION, 650.0, Level.INDICATION),
        (Level.INDICATION, 670.0, Level.NORMAL),
        (Level.EMERGENCY_BRAKE, 650.0, Level.INDICATION),
        (Level.OVERSPEED, 290.0, Level.OVERSPEED),
        (Level.NORMAL, 650.0, Level.NORMAL),
    ],
)
def test_a_level_is_left_once_its_limit_is_kept_by_one_kmh(previous: Level, margin_m: float, level: Level) -> None:
    assert at_margin(margin_m, previous).level is level


def test_a_train_that_brakes_only_when_the_emergency_brake_is_called_keeps_the_target() -> None:
    """A driver who sleeps, at mu = 0.08 on the safe curve of 0.07: the train stands before the target."""
    config = replace(CONFIG, emergency_build_up_s=1.5)
    position, speed, time, braking_since = 0.0, 60.0, 0.0, None
    while speed > 0.0 and position < 6000.0:
        now_ns = NOW_NS + round(time * 1e9)
        curve = StampedCurve(now_ns, position, braking.curve(CRH3, speed, 0.07))
        if braking_since is None:
            decision = decide(config, now_ns, TrainState(now_ns, position, speed), curve)
            braking_since = time if decision.level is Level.EMERGENCY_BRAKE else None
        v = speed * 3.6
        full = 9.8 * (0.08 + 1e-3 * (0.79 + 0.0064 * v + 0.000115 * v**2))
        built_up = braking_since is not None and time >= braking_since + 1.5
        position += speed * 0.1
        speed -= 0.1 * full if built_up else 0.0
        time += 0.1
    assert braking_since is not None
    assert 4600.0 < position < 5000.0


def test_a_state_that_is_old_is_moved_on_at_its_speed() -> None:
    state = TrainState(NOW_NS - SECOND_NS, 1000.0, 40.0)
    decision = decide(CONFIG, NOW_NS, state, CURVE._replace(position_m=1040.0))
    assert decision.reading is not None
    assert decision.reading.distance_to_target_m == pytest.approx(5000.0 - 1000.0 - 40.0)
    assert decision.reading.margin_m == pytest.approx(5000.0 - 1000.0 - 40.0 - 10.0 - NEEDED_M)
    assert decision.state_age_s == pytest.approx(1.0)


@pytest.mark.parametrize("position_m", [0.0, 4999.0, 5001.0, 9000.0])
def test_at_the_target_speed_all_is_well_wherever_the_train_is(position_m: float) -> None:
    config = replace(CONFIG, target_speed_kmh=36.0)
    decision = decide(config, NOW_NS, TrainState(NOW_NS, position_m, 10.0), slow(position_m))
    assert decision.level is Level.NORMAL
    assert decision.reading is not None
    assert decision.reading.braking_distance_m == 0.0


@pytest.mark.parametrize(
    ("speed_kmh", "level"),
    [
        (37.0, Level.OVERSPEED),
        (40.5, Level.WARNING),
        (42.0, Level.SERVICE_BRAKE),
        (44.0, Level.EMERGENCY_BRAKE),
    ],
)
def test_beyond_the_target_its_speed_is_a_ceiling(speed_kmh: float, level: Level) -> None:
    config = replace(CONFIG, target_speed_kmh=36.0)
    state = TrainState(NOW_NS, 5100.0, speed_kmh * KMH)
    assert decide(config, NOW_NS, state, slow(5100.0)).level is level


def test_far_before_the_target_the_line_speed_is_a_ceiling() -> None:
    config = replace(CONFIG, target_position_m=1e6, line_speed_kmh=130.0)
    assert decide(config, NOW_NS, TrainState(NOW_NS, 0.0, 129.0 * KMH), CURVE).level is Level.NORMAL
    assert decide(config, NOW_NS, TrainState(NOW_NS, 0.0, 131.0 * KMH), CURVE).level is Level.OVERSPEED
    assert decide(config, NOW_NS, TrainState(NOW_NS, 0.0, 145.0 * KMH), CURVE).level is Level.EMERGENCY_BRAKE


GOOD_STATE = TrainState(NOW_NS, 0.0, 40.0)
LOST = Unavailable("none received yet")


@pytest.mark.parametrize(
    ("state", "curve", "message"),
    [
        (LOST, CURVE, "state: none received yet"),
        (GOOD_STATE, LOST, "braking curve: none received yet"),
        (GOOD_STATE._replace(t_ns=NOW_NS - 3 * SECOND_NS), CURVE, "state expired: 3 s old, valid for 2 s"),
        (GOOD_STATE._replace(t_ns=NOW_NS + SECOND_NS), CURVE, "state is stamped 1 s ahead of the clock, at most 0.1 s"),
        (GOOD_STATE, CURVE._replace(t_ns=NOW_NS - 5 * SECOND_NS), "braking curve expired: 5 s old, valid for 2 s"),
        (GOOD_STATE, CURVE._replace(t_ns=NOW_NS + 100 * SECOND_NS), "braking curve is stamped 100 s ahead of the"),
        (GOOD_STATE, CURVE._replace(curve=constant(30.0)), "begins at 108.0 km/h but the train runs at 144.0 km/h"),
        (GOOD_STATE, CURVE._replace(curve=constant(40.0, 20.0)), "ends at 72.0 km/h, above the target speed 0.0 km/h"),
    ],
)
def test_whatever_is_missing_old_or_not_covered_is_an_emergency_that_says_why(
    state: TrainState | Unavailable, curve: StampedCurve | Unavailable, message: str
) -> None:
    decision = decide(CONFIG, NOW_NS, state, curve)
    assert decision.level is Level.EMERGENCY_BRAKE
    assert decision.severity is Severity.ERROR
    assert message in decision.message
    assert decision.reading is None


def test_a_curve_is_used_up_to_its_last_moment() -> None:
    curve = CURVE._replace(t_ns=NOW_NS - 2 * SECOND_NS, position_m=-80.0)
    assert decide(CONFIG, NOW_NS, GOOD_STATE, curve).level is Level.NORMAL
    assert decide(CONFIG, NOW_NS + 1, GOOD_STATE, curve).level is Level.EMERGENCY_BRAKE


def test_a_curve_that_ends_at_the_rounded_target_speed_reaches_it() -> None:
    config = replace(CONFIG, target_speed_kmh=36.0)
    curve = CURVE._replace(curve=constant(40.0, 10.0 + 1e-9))
    assert decide(config, NOW_NS, GOOD_STATE, curve).level is Level.NORMAL


def test_levels_carry_their_message() -> None:
    assert len({level.message for level in Level}) == len(Level) == 6

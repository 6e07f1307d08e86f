"""Supervision against hand-computed distances: constant deceleration, v^2/2a."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adhesion_node.core import braking
from adhesion_node.core.braking import BrakingCurve
from adhesion_node.core.supervision import (
    Decision,
    Level,
    Severity,
    StampedCurve,
    Target,
    TrainState,
    Unavailable,
    braking_distance,
    decide,
)
from adhesion_node.core.train import CRH3

NOW_NS = 1_000_000_000_000
SECOND_NS = 1_000_000_000


def constant(first_mps: float, last_mps: float = 0.0, deceleration_mps2: float = 0.8) -> BrakingCurve:
    """Return the curve of a constant deceleration in closed form, on a fine grid."""
    speed = np.linspace(first_mps, last_mps, 2001)
    return BrakingCurve(
        distance_m=(first_mps**2 - speed**2) / (2 * deceleration_mps2),
        speed_mps=speed,
        deceleration_mps2=np.full_like(speed, deceleration_mps2),
        time_s=(first_mps - speed) / deceleration_mps2,
    )


# 40 m/s down to 36 km/h = 10 m/s at 0.8 m/s^2: (1600 - 100)/1.6 = 937.5 m; 2 s of reaction: 80 m.
TARGET = Target(
    target_position_m=5000.0,
    target_speed_kmh=36.0,
    warning_margin_m=300.0,
    service_margin_m=100.0,
    reaction_time_s=2.0,
    valid_for_s=2.0,
)
NEEDED_M = 937.5 + 80.0
CURVE = StampedCurve(NOW_NS, constant(40.0))


def at_margin(margin_m: float, target: Target = TARGET) -> Decision:
    return decide(target, NOW_NS, TrainState(NOW_NS, 5000.0 - NEEDED_M - margin_m, 40.0), CURVE)


@pytest.mark.parametrize(
    ("margin_m", "level", "severity"),
    [
        (1000.0, Level.NORMAL, Severity.OK),
        (300.5, Level.NORMAL, Severity.OK),
        (299.5, Level.WARNING, Severity.WARN),
        (100.5, Level.WARNING, Severity.WARN),
        (99.5, Level.SERVICE_BRAKE, Severity.ERROR),
        (0.5, Level.SERVICE_BRAKE, Severity.ERROR),
        (-0.5, Level.EMERGENCY_BRAKE, Severity.ERROR),
    ],
)
def test_levels_follow_the_margin(margin_m: float, level: Level, severity: Severity) -> None:
    decision = at_margin(margin_m)
    assert (decision.level, decision.severity) == (level, severity)
    assert decision.margin_m == pytest.approx(margin_m, abs=0.01)
    assert decision.braking_distance_m == pytest.approx(937.5, abs=0.01)
    assert decision.reaction_distance_m == pytest.approx(80.0)
    assert decision.message == level.message


def test_braking_distance_is_measured_from_the_present_speed() -> None:
    # The train has slowed to 30 m/s since the curve was made: (900 - 100)/1.6 = 500 m.
    assert braking_distance(constant(40.0), 30.0, 10.0) == pytest.approx(500.0, abs=0.01)
    assert braking_distance(constant(40.0), 30.0, 0.0) == pytest.approx(562.5, abs=0.01)


def test_braking_distance_of_a_real_curve_is_the_one_of_a_curve_from_that_speed() -> None:
    whole = braking.curve(CRH3, 83.0, 0.08)
    part = braking.curve(CRH3, 60.0, 0.08, target_mps=20.0)
    assert braking_distance(whole, 60.0, 20.0) == pytest.approx(part.distance_m[-1], rel=1e-3)


def test_a_speed_above_the_curve_is_braked_at_its_weakest_deceleration() -> None:
    weak_at_the_top = replace(constant(40.0), deceleration_mps2=np.linspace(0.5, 1.1, 2001))
    # 42 to 40 m/s at 0.5 m/s^2: (1764 - 1600)/1.0 = 164 m, then the curve's 937.5 m.
    assert braking_distance(weak_at_the_top, 42.0, 10.0) == pytest.approx(164.0 + 937.5, abs=0.01)


def test_a_train_that_accelerates_past_the_target_speed_is_braked_though_its_curve_has_no_length() -> None:
    flat = constant(10.0, 10.0)
    # 11 to 10 m/s at 0.8 m/s^2: 21/1.6 = 13.125 m.
    assert braking_distance(flat, 11.0, 10.0) == pytest.approx(13.125)


def test_a_state_that_is_old_is_moved_on_at_its_speed() -> None:
    state = TrainState(NOW_NS - SECOND_NS, 1000.0, 40.0)
    decision = decide(TARGET, NOW_NS, state, CURVE)
    assert decision.margin_m == pytest.approx(5000.0 - 1000.0 - 40.0 - NEEDED_M, abs=0.01)
    assert decision.state_age_s == pytest.approx(1.0)


def test_past_the_target_and_too_fast_is_an_emergency() -> None:
    decision = decide(TARGET, NOW_NS, TrainState(NOW_NS, 5001.0, 10.1), CURVE)
    assert decision.level is Level.EMERGENCY_BRAKE
    assert decision.severity is Severity.ERROR


@pytest.mark.parametrize("position_m", [0.0, 4999.0, 5001.0, 9000.0])
def test_at_the_target_speed_all_is_well_wherever_the_train_is(position_m: float) -> None:
    decision = decide(TARGET, NOW_NS, TrainState(NOW_NS, position_m, 10.0), CURVE)
    assert decision.level is Level.NORMAL
    assert decision.braking_distance_m == 0.0


GOOD_STATE = TrainState(NOW_NS, 0.0, 40.0)
LOST = Unavailable("none received yet")


@pytest.mark.parametrize(
    ("state", "curve", "message"),
    [
        (LOST, CURVE, "state: none received yet"),
        (GOOD_STATE, LOST, "braking curve: none received yet"),
        (GOOD_STATE._replace(t_ns=NOW_NS - 3 * SECOND_NS), CURVE, "state expired: 3 s old, valid for 2 s"),
        (GOOD_STATE, CURVE._replace(t_ns=NOW_NS - 5 * SECOND_NS), "braking curve expired: 5 s old, valid for 2 s"),
        (GOOD_STATE, CURVE._replace(t_ns=NOW_NS + 100 * SECOND_NS), "braking curve is stamped 100 s ahead of the"),
        (GOOD_STATE, StampedCurve(NOW_NS, constant(30.0)), "begins at 108.0 km/h but the train runs at 144.0 km/h"),
        (GOOD_STATE, StampedCurve(NOW_NS, constant(40.0, 20.0)), "ends at 72.0 km/h, above the target speed 36.0 km/h"),
    ],
)
def test_whatever_is_missing_old_or_not_covered_is_an_emergency_that_says_why(
    state: TrainState | Unavailable, curve: StampedCurve | Unavailable, message: str
) -> None:
    decision = decide(TARGET, NOW_NS, state, curve)
    assert decision.level is Level.EMERGENCY_BRAKE
    assert decision.severity is Severity.STALE
    assert message in decision.message
    assert decision.margin_m is None


def test_a_curve_is_used_up_to_its_last_moment() -> None:
    curve = CURVE._replace(t_ns=NOW_NS - 2 * SECOND_NS)
    assert decide(TARGET, NOW_NS, GOOD_STATE, curve).level is Level.NORMAL
    assert decide(TARGET, NOW_NS + 1, GOOD_STATE, curve).level is Level.EMERGENCY_BRAKE


def test_a_curve_that_ends_at_the_rounded_target_speed_reaches_it() -> None:
    curve = StampedCurve(NOW_NS, constant(40.0, 10.0 + 1e-9))
    assert decide(TARGET, NOW_NS, GOOD_STATE, curve).level is Level.NORMAL


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"target_position_m": float("nan")}, r"target_position_m = nan: give a finite position"),
        ({"valid_for_s": -1.0}, r"valid_for_s = -1\.0: give a finite number of at least 0"),
        ({"target_speed_kmh": float("inf")}, r"target_speed_kmh = inf: give a finite number"),
        ({"warning_margin_m": 50.0}, r"warning_margin_m = 50\.0: give at least service_margin_m = 100\.0"),
    ],
)
def test_a_target_refuses_values_out_of_range(values: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Target(**values)


def test_levels_carry_their_message() -> None:
    assert len({level.message for level in Level}) == len(Level) == 4

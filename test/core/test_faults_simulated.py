# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The simulator's faults: each one does what its name says, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from messages import message_of
from rclpy.context import Context
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher

from adhesion_node.core.physics.train import GRAVITY
from adhesion_node.wire import topics
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.topic import Topic
from sim_node.faults.plan import FAULTS, Plan, faulty_run, period_of
from sim_node.faults.streams import RATES_HZ
from sim_node.nodes.simulator import Simulator
from sim_node.train.scenario import find
from sim_node.train.sensors import SensorMessage, SensorSettings, Tick

S = 10**9
SETTINGS = SensorSettings(speed_std_mps=0.1, wheel_speed_std_radps=0.1)

OF_THE_RUN = ("heavy_tails", "irregular", "grade", "mass")
"""Faults that make another run of it; the others only change its messages."""


def ticks(fault: str, seed: int = 1, start_s: float = 30.0, **dose: float) -> list[Tick]:
    given = {f"fault_{name}": value for name, value in dose.items()}
    plan = Plan(fault, start_s, **given)
    return list(faulty_run(plan, find("tunnel_entry"), period_of(plan, 0.1), seed, SETTINGS))


def sent(run: Sequence[Tick], topic: Topic = topics.POSITION) -> list[SensorMessage]:
    return [message for _, messages in run for message in messages if message.topic == topic]


CLEAN = ticks("none")


def usable(messages: Sequence[SensorMessage]) -> list[SensorMessage]:
    """Return those that the reader does not refuse."""
    kept = []
    for message in messages:
        try:
            topics.POSITION.read(message_of(message))
        except Rejected:
            continue
        kept.append(message)
    return kept


@pytest.mark.parametrize("fault", sorted(set(FAULTS) - set(OF_THE_RUN)))
def test_before_its_start_and_in_the_truth_a_fault_changes_nothing(fault: str) -> None:
    run = ticks(fault)
    assert [truth for truth, _ in run] == [truth for truth, _ in CLEAN]
    assert run[:300] == CLEAN[:300]
    assert (run[300:] == CLEAN[300:]) == (fault == "none")


@pytest.mark.parametrize("fault", sorted(FAULTS))
def test_a_seed_gives_one_run(fault: str) -> None:
    for one, again in zip(ticks(fault, 7), ticks(fault, 7), strict=True):
        assert one == again or repr(one) == repr(again)  # NaN is not itself


def test_a_dropout_loses_the_positions_of_its_time_alone() -> None:
    run = ticks("dropout", start_s=40.0, duration_s=2.0)
    lost = {m.t_ns for m in sent(CLEAN)} - {m.t_ns for m in sent(run)}
    assert lost == {40 * S + k * S // 10 for k in range(20)}
    assert sent(run, topics.BRAKE_PRESSURE) == sent(CLEAN, topics.BRAKE_PRESSURE)


def test_a_variance_that_is_not_told_is_0_in_the_message() -> None:
    told, clean = sent(ticks("zero_variance")), sent(CLEAN)
    assert [message.values for message in told] == [message.values for message in clean]
    assert sum(message.variance == 0.0 for message in told if message.topic == topics.POSITION) > 10


def test_random_loss_has_its_share() -> None:
    lost = 1.0 - (len(sent(ticks("loss"))) - 300) / (len(sent(CLEAN)) - 300)
    assert lost == pytest.approx(0.3, abs=0.08)


@pytest.mark.parametrize(("fault", "count"), [("outliers", (12, 45)), ("burst", (10, 10))])
def test_outliers_are_20_m_off(fault: str, count: tuple[int, int]) -> None:
    errors = [a.values[0] - b.values[0] for a, b in zip(sent(ticks(fault)), sent(CLEAN), strict=True)]
    far = [error for error in errors if error]
    assert np.abs(far) == pytest.approx(20.0)
    assert count[0] <= len(far) <= count[1]
    assert min(far) < 0 < max(far)


@pytest.mark.parametrize("fault", ["nan", "inf", "huge", "negative_variance"])
def test_what_nobody_can_use_comes_on_top(fault: str) -> None:
    messages = sent(ticks(fault))
    assert len(messages) > len(sent(CLEAN)) + 20
    assert usable(messages) == sent(CLEAN)


def test_late_messages_leave_late_with_their_stamps() -> None:
    run = ticks("late", size=0.3)
    stamps = [m.t_ns for m in sent(run)]
    assert sorted(stamps[:-30]) != stamps[:-30]
    lags = {truth.t_ns - m.t_ns for truth, messages in run for m in messages}
    assert lags == {0, 3 * S // 10}


def test_duplicates_come_twice() -> None:
    messages = sent(ticks("duplicates"))
    repeated = sum(a == b for a, b in pairwise(messages))
    assert 25 < repeated == len(messages) - len(sent(CLEAN))


@pytest.mark.parametrize(("fault", "by_s"), [("stamps_back", -100), ("stamps_forward", 3600)])
def test_stamps_jump_for_good(fault: str, by_s: int) -> None:
    jumps = [a.t_ns - b.t_ns for a, b in zip(sent(ticks(fault)), sent(CLEAN), strict=True)]
    assert jumps == [0] * 300 + [by_s * S] * (len(jumps) - 300)


def test_a_paused_clock_stands_still_and_is_right_again() -> None:
    stamps = [m.t_ns for m in sent(ticks("clock_pause", duration_s=5.0))]
    assert stamps == [*range(0, 30 * S, S // 10), *([30 * S] * 50), *range(35 * S, len(stamps) * S // 10, S // 10)]


def test_a_stuck_position_is_freshly_stamped() -> None:
    messages = sent(ticks("stuck"))
    assert [m.t_ns for m in messages] == [m.t_ns for m in sent(CLEAN)]
    assert {m.values for m in messages[299:400]} == {messages[299].values}
    assert messages[400] == sent(CLEAN)[400]


def test_rates_change_in_turn_and_are_uneven() -> None:
    stamps = np.array([m.t_ns for m in sent(ticks("irregular"))]) * 1e-9
    for turn, rate_hz in enumerate(RATES_HZ):
        begin = 30.0 + 10.0 * turn
        periods = np.diff(stamps[(stamps >= begin + 1.5) & (stamps < begin + 10.0)]) * rate_hz
        assert periods.mean() == pytest.approx(1.0, abs=0.15)
        assert 0.6 <= periods.min() < 0.95
        assert 1.05 < periods.max() <= 1.4


def test_the_whole_run_is_downhill_or_heavier() -> None:
    slowing = {}
    for fault in ("none", "grade", "mass"):
        speeds = [truth.speed_mps for truth, _ in ticks(fault)]
        slowing[fault] = (speeds[250] - speeds[450]) / 20.0
    assert slowing["none"] - slowing["grade"] == pytest.approx(0.005 * GRAVITY, rel=0.1)
    assert slowing["mass"] == pytest.approx(slowing["none"], rel=0.01)  # the rail limits: F and R grow with the mass
    brake = [truth.applied for truth, _ in ticks("mass")][-1]
    assert brake == pytest.approx(0.0952 / 1.1, abs=1e-4)


def test_a_balise_moves_all_positions_from_then_on() -> None:
    moved = [a.values[0] - b.values[0] for a, b in zip(sent(ticks("balise_step")), sent(CLEAN), strict=True)]
    assert moved == pytest.approx([0.0] * 300 + [2.0] * (len(moved) - 300))


def test_units_and_frames_are_mistaken() -> None:
    assert {m.frame for m in sent(ticks("wrong_frame"))[300:]} == {"map"}
    speeds = zip(sent(ticks("kmh"), topics.SPEED), sent(CLEAN, topics.SPEED), strict=True)
    assert [a.values[0] / b.values[0] for a, b in speeds][300:] == pytest.approx([3.6] * (len(CLEAN) - 300))
    pressures = zip(sent(ticks("gauge"), topics.BRAKE_PRESSURE), sent(CLEAN, topics.BRAKE_PRESSURE), strict=True)
    assert {round(b.values[0] - a.values[0]) for a, b in pressures} == {0, 101325}


def test_speeds_and_wheels_stand_or_hang() -> None:
    assert {m.values for m in sent(ticks("speed_zero"), topics.SPEED)[300:]} == {(0.0,)}
    assert len({m.values for m in sent(ticks("wheels_stuck"), topics.WHEEL_SPEED)[299:]}) == 1
    silent = np.array([m.values for m in sent(ticks("wheels_silent"), topics.WHEEL_SPEED)])
    half = silent.shape[1] // 2
    assert (silent[:300] > 0.0).all()
    assert not silent[300:, :half].any()
    assert (silent[300:500, half:] > 0.0).all()


def test_heavy_tails_are_heavy() -> None:
    run = ticks("heavy_tails")
    errors = np.array([messages[-1].values[0] - truth.position_m for truth, messages in run])
    assert np.mean(np.abs(errors) > 2.0) > 0.02  # 4 standard deviations: 6e-5 of a Gaussian's
    assert math.isfinite(errors.max())


def test_an_unknown_fault_is_named_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match="fault = 'drop': choose one of none, dropout, loss"):
        Plan("drop")


def test_the_node_sends_what_the_fault_makes(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    frames: list[str] = []

    def publish(publisher: Publisher, message: Any) -> None:
        if publisher.topic_name == "/position":
            frames.append(message.header.frame_id)

    monkeypatch.setattr(Publisher, "publish", publish)
    values = {"fault": "wrong_frame", "fault_start_s": 0.1, "scenario": "cruise"}
    overrides = [Parameter(name, value=value) for name, value in values.items()]
    node = Simulator(paced=False, context=context, parameter_overrides=overrides)
    for _ in range(3):
        node.tick()
    assert frames == ["track", "map", "map"]
    node.destroy_node()

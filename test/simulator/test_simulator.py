# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The simulator node: what it publishes, in which order, at which pace, and how it ends."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import replace
from typing import Any

import pytest
from conftest import SpinUntil
from published import Sent, by_topic, sent
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from sim_node.nodes import simulator
from sim_node.nodes.simulator import Simulator
from sim_node.real.drive import START_S, drive
from sim_node.real.plant.scenarios import SCENARIOS as REAL
from sim_node.real.run import truths
from sim_node.real.sensors.fitted import FITTED
from sim_node.train.run import run
from sim_node.train.scenario import find
from sim_node.train.sensors import SensorSettings

__all__ = ["sent"]


def _simulator(context: Context, *, paced: bool = False, **parameters: Any) -> Simulator:
    overrides = [Parameter(name, value=value) for name, value in parameters.items()]
    return Simulator(paced=paced, context=context, parameter_overrides=overrides)


def _destroy(node: Node) -> None:
    node.destroy_node()


def _drive(simulator: Simulator) -> int:
    """Tick to the end, destroy the node, return the number of samples."""
    samples = 0
    while simulator.tick():
        samples += 1
    _destroy(simulator)
    return samples


def _nanoseconds(stamp: Any) -> int:
    return int(stamp.sec * 10**9 + stamp.nanosec)


def test_a_sample_is_published_in_the_agreed_order(context: Context, sent: Sent) -> None:
    simulator = _simulator(context, speed_std_mps=0.1, wheel_speed_std_radps=0.1)
    for _ in range(3):
        assert simulator.tick()
    order = ["/clock", "/truth/state", "/truth/mu", "/brake_pressure", "/speed", "/wheel_speed", "/position"]
    assert [topic for topic, _ in sent] == order * 3
    _destroy(simulator)


def test_all_sensors_of_a_sample_share_their_stamp(context: Context, sent: Sent) -> None:
    _drive(
        _simulator(
            context, rate_hz=4.0, start_time_s=12.5, scenario="cruise", speed_std_mps=0.1, wheel_speed_std_radps=0.1
        )
    )
    lists = by_topic(sent)
    expected = [12_500_000_000 + k * 250_000_000 for k in range(241)]
    assert [_nanoseconds(m.clock) for m in lists["/clock"]] == expected
    for topic in ("/position", "/speed", "/wheel_speed", "/brake_pressure", "/truth/state"):
        assert [_nanoseconds(m.header.stamp) for m in lists[topic]] == expected
        assert {m.header.frame_id for m in lists[topic]} == {"track"}


def test_messages_carry_the_run_and_its_variances(context: Context, sent: Sent) -> None:
    parameters: dict[str, Any] = {"position_std_m": 0.3, "pressure_std_pa": 500.0, "speed_std_mps": 0.2}
    parameters["wheel_speed_std_radps"] = 0.1
    _drive(_simulator(context, scenario="tunnel_exit", seed=4, rate_hz=2.0, **parameters))
    lists = by_topic(sent)
    expected = list(run(find("tunnel_exit"), 0.5, 4, SensorSettings(**parameters)))
    assert [m.pose.pose.position.x for m in lists["/position"]] == [r.position_m for _, r in expected]
    assert {m.pose.covariance[0] for m in lists["/position"]} == {0.3**2}
    assert {m.pose.pose.orientation.w for m in lists["/position"]} == {1.0}
    assert [m.fluid_pressure for m in lists["/brake_pressure"]] == [r.pressure_pa for _, r in expected]
    assert {m.variance for m in lists["/brake_pressure"]} == {500.0**2}
    assert [m.twist.twist.linear.x for m in lists["/speed"]] == [r.speed_mps for _, r in expected]
    assert {m.twist.covariance[0] for m in lists["/speed"]} == {0.2**2}
    assert [tuple(m.velocity) for m in lists["/wheel_speed"]] == [r.wheel_radps for _, r in expected]
    assert {tuple(m.name) for m in lists["/wheel_speed"]} == {("axle_1", "axle_2", "axle_3", "axle_4")}
    assert [m.data for m in lists["/truth/mu"]] == [t.mu for t, _ in expected]
    assert [m.pose.pose.position.x for m in lists["/truth/state"]] == [t.position_m for t, _ in expected]
    assert [m.twist.twist.linear.x for m in lists["/truth/state"]] == [t.speed_mps for t, _ in expected]
    assert {m.child_frame_id for m in lists["/truth/state"]} == {"train"}


def test_pressure_is_absolute(context: Context, sent: Sent) -> None:
    _drive(_simulator(context, rate_hz=1.0))
    pressures = [m.fluid_pressure for m in by_topic(sent)["/brake_pressure"]]
    assert pressures[:20] == [101325.0] * 20
    assert set(pressures[20:]) == {511325.0}


def test_adhesion_drops_as_published_when_the_brake_comes_on(context: Context, sent: Sent) -> None:
    _drive(_simulator(context, scenario="tunnel_entry"))
    mu = [m.data for m in by_topic(sent)["/truth/mu"]]
    assert mu[199:201] == pytest.approx([0.1432, 0.0726], abs=1.5e-4)


SHORT = replace(REAL["tram_wet"], speed_mps=8.0, demands=((1.0, 1.0),))
"""A tram that stops from 29 km/h: 11 s."""


def test_a_real_train_sends_what_its_drive_holds_in_order_of_arrival(
    context: Context, sent: Sent, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulator, "REAL", {"tram_wet": SHORT})
    node = _simulator(context, scenario="tram_wet", sensors="one_cylinder_wheels", seed=3, start_time_s=500.0)
    _drive(node)
    (driven,) = drive(SHORT, FITTED["one_cylinder_wheels"], [3])
    sensors = ("/position", "/brake_pressure", "/wheel_speed")
    stamps = [(topic, _nanoseconds(m.header.stamp)) for topic, m in sent if topic in sensors]
    expected = [(f"/{m.topic.name}", m.t_ns - round((START_S - 500.0) * 1e9)) for _, m in driven.messages]
    assert stamps == expected[: len(stamps)]
    assert len(stamps) > 250
    lists = by_topic(sent)
    clocks = [_nanoseconds(m.clock) * 1e-9 for m in lists["/clock"]]
    assert clocks == sorted(clocks)
    assert len(clocks) == len(stamps) + len(lists["/truth/mu"]) == len(stamps) + len(lists["/truth/state"])
    used = [m.data for m in lists["/truth/mu"]]
    assert used == [driven.journey.used[5 * k] for k in range(len(used))]
    known = truths(driven.journey)
    assert [m.data for m in lists["/truth/limited"]] == [
        known[5 * k].regime == "ADHESION_LIMITED" for k in range(len(used))
    ]
    assert [state for _, state in node.changes][-1] == "COASTING"  # it stands


def test_a_real_train_keeps_the_pace_of_its_clock(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulator, "REAL", {"tram_wet": SHORT})
    node = _simulator(context, paced=True, scenario="tram_wet", sensors="gnss", real_time_factor=20.0)
    executor.add_node(node)
    begun = time.monotonic()
    spin_until(executor, lambda: node.finished)
    lasted_s = (node.now_ns - 1000 * 10**9) / 20e9
    assert time.monotonic() - begun > 0.95 * lasted_s


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"scenario": "leaves", "fault": "late"}, "fault = 'late': a real train has its noise and faults by `sensors`"),
        (
            {"scenario": "leaves", "speed_std_mps": 0.1},
            r"speed_std_mps = 0\.1: a real train has its noise and faults by",
        ),
        ({"sensors": "full"}, "sensors = 'full': are those of a real train: leave them out, or choose a scenario of"),
        ({"fault_size": 3.0}, r"fault_size = 3\.0: nothing goes wrong without `fault`: name one, or leave this out"),
        ({"fault": "kmh"}, "fault = 'kmh': there is no such sensor: give speed_std_mps above 0"),
        ({"fault": "speed_zero"}, "fault = 'speed_zero': there is no such sensor: give speed_std_mps above 0"),
        (
            {"fault": "wheels_silent", "speed_std_mps": 0.1},
            "fault = 'wheels_silent': there is no such sensor: give wheel_speed_std_radps above 0",
        ),
        (
            {"fault": "wheels_stuck"},
            "fault = 'wheels_stuck': there is no such sensor: give wheel_speed_std_radps above 0",
        ),
    ],
)
def test_what_a_scenario_does_not_heed_is_refused(context: Context, given: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        _simulator(context, **given)


@pytest.mark.parametrize("fault", ["nan", "inf"])
def test_a_fault_whose_name_is_a_number_to_yaml_is_taken(context: Context, fault: str) -> None:
    node = Simulator(paced=False, context=context, cli_args=["--ros-args", "-p", f"fault:={fault}"])
    assert node.values["fault"] == fault
    assert node.get_parameter("fault").value == fault
    _destroy(node)


def test_same_seed_same_messages_another_seed_others(context: Context, sent: Sent) -> None:
    runs = []
    for seed in (5, 5, 6):
        sent.clear()
        _drive(_simulator(context, seed=seed, rate_hz=1.0, outlier_fraction=0.1, student_dof=3.0, speed_std_mps=0.1))
        runs.append(list(sent))
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_a_sensor_parameter_leaves_the_truth_alone(context: Context, sent: Sent) -> None:
    truths = []
    changes: tuple[dict[str, Any], ...] = ({}, {"outlier_fraction": 0.2, "position_std_m": 2.0, "speed_std_mps": 0.3})
    for parameters in changes:
        sent.clear()
        _drive(_simulator(context, rate_hz=1.0, **parameters))
        lists = by_topic(sent)
        truths.append((lists["/truth/state"], lists["/truth/mu"]))
    assert truths[0] == truths[1]


def test_a_dropout_misses_the_position_only(context: Context, sent: Sent) -> None:
    samples = _drive(_simulator(context, rate_hz=2.0, dropout_fraction=0.5))
    lists = by_topic(sent)
    assert len(lists["/brake_pressure"]) == len(lists["/clock"]) == samples
    assert 0.3 * samples < len(lists["/position"]) < 0.7 * samples


def test_without_odometer_there_is_no_speed_topic(context: Context) -> None:
    names = [{p.topic_name for p in _simulator(context, speed_std_mps=std).publishers} for std in (0.0, 0.1)]
    assert "/speed" not in names[0]
    assert names[1] - names[0] == {"/speed"}


def test_topics_are_relative_but_the_clock_is_shared(context: Context) -> None:
    simulator = Simulator(paced=False, context=context, namespace="/train7")
    names = {p.topic_name for p in simulator.publishers}
    assert {"/clock", "/train7/position", "/train7/truth/mu"} <= names
    _destroy(simulator)


def _program(*arguments: str) -> subprocess.CompletedProcess[str]:
    # The wheels' bootstrap leaves these two behind; a child would take itself for set up already.
    leaked = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
    environment = {name: value for name, value in os.environ.items() if name not in leaked}
    code = "from sim_node.nodes.simulator import main; raise SystemExit(main())"
    command = [sys.executable, "-c", code, "--ros-args"]
    return subprocess.run(
        [*command, *arguments], env=environment, capture_output=True, text=True, timeout=60, check=False
    )


def test_the_program_tells_an_unknown_scenario_in_one_line() -> None:
    ended = _program("-p", "scenario:=tunel")
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert ended.stderr.count("\n") == 1
    assert "scenario = 'tunel': choose one of tunnel_entry" in ended.stderr


def test_the_program_reports_start_regimes_and_end_and_exits() -> None:
    """An integer rate is taken for a number; nothing else is logged than one line per event."""
    ended = _program("-p", "scenario:=tunnel_exit", "-p", "rate_hz:=10", "-p", "real_time_factor:=0")
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == ""
    said = [line.split("]: ", 1)[1] for line in ended.stderr.splitlines() if "parameters: " not in line]
    assert said[0] == "scenario tunnel_exit: started at 1000.0 s"
    assert [line.split()[2] for line in said[1:-1]] == ["COASTING", "ADHESION_LIMITED", "BRAKE_LIMITED"]
    assert said[2] == "20.0 s: ADHESION_LIMITED at 250 km/h, mu 0.0770"
    assert said[-1].startswith("scenario tunnel_exit: ended after ")

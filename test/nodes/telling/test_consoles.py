# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the nodes log: the story of a run, and nothing red while all is well."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import messages
import pytest
from conftest import SpinUntil
from monitor_line import curve, state
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.nodes import atp_monitor
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from sim_node.nodes.simulator import Simulator
from sim_node.train import scenario
from sim_node.train.run import run
from sim_node.train.sensors import Reading

Logged = Callable[[], list[str]]


@pytest.fixture
def logged(capfd: pytest.CaptureFixture[str]) -> Logged:
    """Return a function that returns all lines logged so far."""
    lines: list[str] = []

    def all_lines() -> list[str]:
        lines.extend(capfd.readouterr().err.splitlines())
        return lines

    return all_lines


def overridden(**values: object) -> list[Parameter]:
    return [Parameter(name, value=value) for name, value in values.items()]


def test_a_monitor_that_is_started_first_waits_and_is_not_in_error(
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    logged: Logged,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(atp_monitor, "GRACE_S", math.inf)  # on a busy machine the early days may be over before
    monitor, driver = AtpMonitor(context=context), Node("driver", context=context)
    executor.add_node(monitor)
    executor.add_node(driver)
    spin_until(executor, lambda: monitor.published[topics.ATP_STATUS] > 0)
    assert monitor._level is not None
    assert monitor._level.name == "EMERGENCY_BRAKE", "what it publishes is as careful as ever"
    ends = qos.advertise(driver, topics.STATE, qos.RESULT), qos.advertise(driver, topics.BRAKING_CURVE, qos.LATCHED)
    spin_until(executor, lambda: all(end.get_subscription_count() == 1 for end in ends))
    ends[0].publish(state(0.0, 40.0, 0.0))
    spin_until(executor, lambda: monitor.heard[topics.STATE] == 1)
    assert any("waiting for the first estimate; until then EMERGENCY_BRAKE: " in line for line in logged())
    assert not [line for line in logged() if "[ERROR]" in line]
    ends[1].publish(curve(0.0, 0.0))
    spin_until(executor, lambda: monitor.heard[topics.BRAKING_CURVE] == 1)
    spin_until(executor, lambda: any("[ERROR]" in line for line in logged()))  # their stamps are of 1970


def test_silence_is_an_error_once_it_lasts(
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    logged: Logged,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(atp_monitor, "GRACE_S", 0.5)
    executor.add_node(AtpMonitor(context=context))
    spin_until(executor, lambda: any("[ERROR]" in line for line in logged()))
    (red,) = [line for line in logged() if "[ERROR]" in line]
    assert "emergency brake: state: none received yet; is the estimator running" in red


def test_the_estimator_tells_of_regimes(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, logged: Logged
) -> None:
    fast = overridden(method="particle_em", iterations=10, particles=10, step=10)
    estimator, driver = Estimator(context=context, parameter_overrides=fast), Node("driver", context=context)
    executor.add_node(estimator)
    executor.add_node(driver)
    inputs = {topic: qos.advertise(driver, topic) for topic in (topics.BRAKE_PRESSURE, topics.POSITION)}
    spin_until(executor, lambda: all(each.get_subscription_count() for each in inputs.values()))

    def send(reading: Reading) -> None:
        heard = estimator.heard[topics.POSITION]
        inputs[topics.BRAKE_PRESSURE].publish(messages.brake_pressure(reading.t_ns, reading.pressure_pa, 0.0))
        inputs[topics.POSITION].publish(messages.position(reading.t_ns, reading.position_m or 0.0, 0.5))
        spin_until(executor, lambda: estimator.heard[topics.POSITION] > heard)

    for truth, reading in run(scenario.find("tunnel_entry"), 0.1, 1):
        if 15e9 <= truth.t_ns < 33e9:
            send(reading)
    told = [line.split("]: ", 1)[1] for line in logged() if re.search(r"\]: \d+\.\d s: [A-Z_]+ at", line)]
    assert re.fullmatch(r"\d+\.\d s: COASTING at (299|300|301) km/h, mu .*: nothing can be learnt of .*", told[0])
    limited = next(line for line in told if "ADHESION_LIMITED" in line)
    assert re.search(r" at 2\d\d km/h, mu 0\.0[67]\d\d, at least 0\.0\d{3}: the adhesion limits", limited)
    assert len(told) < 8, "changes, not estimates"


def test_parameters_are_told_where_they_are_not_default(context: Context, logged: Logged) -> None:
    Estimator(context=context, parameter_overrides=overridden(start_mu=0.12)).destroy_node()
    Estimator(context=context).destroy_node()
    given, none = (line.split("]: ", 1)[1] for line in logged() if "parameters: " in line)
    assert given == "parameters: start_mu = 0.12, all others at their defaults"
    assert none == "parameters: all defaults"


def test_the_simulator_tells_when_a_fault_begins_and_ends(context: Context, logged: Logged) -> None:
    faulty = overridden(scenario="cruise", fault="dropout", fault_start_s=2.0, real_time_factor=0.0)
    simulator = Simulator(paced=False, context=context, parameter_overrides=faulty)
    while simulator.tick():
        pass
    simulator.destroy_node()
    told = [line.split("]: ", 1)[1] for line in logged() if "fault " in line and "parameters" not in line]
    assert told == ["2.0 s: fault dropout begins: no positions", "7.0 s: fault dropout ends"]

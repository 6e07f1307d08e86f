# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the estimator says as a node: what it refused and why, what is missing or contradictory, what it has learnt."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import messages
import numpy as np
import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from estimator_line import Line, S, estimating, offline_digest, samples
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from windowed import Failing

from adhesion_node.nodes.estimator import Estimator
from adhesion_node.wire import topics


@pytest.fixture
def line(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Line:
    return estimating(context, executor, spin_until)


def test_bad_messages_are_dropped_counted_and_change_nothing(line: Line) -> None:
    readings = [reading for _, reading in samples("tunnel_entry", 15.0, 24.0)]
    for index, reading in enumerate(readings):
        line.send_sample(reading)
        if index == 40:
            for message in bad_positions(reading.t_ns + 1):
                line.send(topics.POSITION, message)
            gauge = messages.brake_pressure(reading.t_ns + 1, 410.0, 0.0)
            line.send(topics.BRAKE_PRESSURE, gauge)
    line.estimator.close()
    line.hear_all()
    values = line.values()
    assert {key: value for key, value in values.items() if key.startswith("dropped.")} == {
        "dropped.WRONG_FRAME": "2",
        "dropped.NOT_FINITE": "2",
        "dropped.BAD_VARIANCE": "2",
        "dropped.IMPLAUSIBLE_POSITION": "1",
        "dropped.IMPLAUSIBLE_PRESSURE": "1",
    }
    assert line.estimator.digest == offline_digest(readings)


def test_a_gauge_whose_zero_is_off_is_told(line: Line) -> None:
    for _, reading in samples("tunnel_entry", 0.0, 12.0):
        line.send_sample(reading._replace(pressure_pa=reading.pressure_pa + 15e3))
    line.hear_all()
    assert float(line.values()["gauge_zero"]) == pytest.approx(15e3)


def bad_positions(t_ns: int) -> Iterator[Any]:
    for frame in ("map", ""):
        message = messages.position(t_ns, 10.0, 0.5)
        message.header.frame_id = frame
        yield message
    for position in (float("nan"), float("inf"), 1e9):
        yield messages.position(t_ns, position, 0.5)
    for variance in (1e300, -1.0):
        message = messages.position(t_ns, 10.0, 0.5)
        message.pose.covariance[0] = variance
        yield message


def test_the_first_refusal_is_said_with_its_remedy(line: Line) -> None:
    message = messages.position(10**9, 10.0, 0.5)
    message.header.frame_id = "map"
    line.send(topics.POSITION, message)
    line.hear_all()
    heard: list[DiagnosticArray] = line.heard[topics.DIAGNOSTICS]
    (status,) = heard[-1].status
    assert status.level == DiagnosticStatus.WARN
    assert "header.frame_id = 'map', frame = 'track': set header.frame_id" in status.message


def test_a_window_whose_numbers_fail_is_told(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    overrides = [Parameter("method", value="rail_condition")]
    node = Estimator(context=context, parameter_overrides=overrides)
    failing = Failing(np.linalg.LinAlgError("singular"), at=1)
    node.pipeline.state = node.pipeline.state._replace(method=failing)
    line = Line(executor, spin_until, node, Node("driver", context=context))
    for _, reading in samples("tunnel_entry", 15.0, 21.5):
        line.send_sample(reading)
    line.hear_all()
    told = [message.status[0] for message in line.heard[topics.DIAGNOSTICS]]
    assert any("(singular): the numbers of a window failed" in status.message for status in told)
    assert line.values()["dropped.FAILED"] == "1"


def test_a_parameter_of_another_method_is_warned_of(context: Context, capfd: pytest.CaptureFixture[str]) -> None:
    overrides = [Parameter("particles", value=50), Parameter("window", value=50)]
    Estimator(context=context, parameter_overrides=overrides).destroy_node()
    assert capfd.readouterr().err.count("does not read it") == 1


def test_what_the_journey_teaches_is_told_with_its_standard_deviation(line: Line) -> None:
    for _, reading in samples("cruise", 0.0, 2.0):
        if reading.position_m is not None:
            line.send(topics.POSITION, messages.position(reading.t_ns, reading.position_m, 0.5))
    line.hear_all()
    values = line.values()
    free = float(values["probability.free"]) + float(values["probability.steady"])
    assert float(values["brake_factor"]) == 1.0
    assert free == pytest.approx(1.0, abs=1e-4)  # each is told to five digits
    for name in ("brake_factor", "grade_residual", "position_error", "speed_scale_error", "acceleration_bias"):
        assert float(values[f"{name}_std"]) > 0.0
        assert abs(float(values[name])) < 3.0


def test_a_missing_brake_pressure_is_said(line: Line) -> None:
    for _, reading in samples("cruise", 0.0, 2.0):
        if reading.position_m is not None:
            line.send(topics.POSITION, messages.position(reading.t_ns, reading.position_m, 0.5))
    line.hear_all()
    (status,) = line.heard[topics.DIAGNOSTICS][-1].status
    assert status.level == DiagnosticStatus.WARN
    assert status.message.startswith("no brake pressure: mu is what slows the train")


def test_two_clocks_in_one_topic_are_told(line: Line) -> None:
    """Positions of a second source, 4000 s ahead: each is counted, /diagnostics names the sensor and its distance."""
    for _, reading in samples("tunnel_entry", 15.0, 18.0):
        line.send_sample(reading)
        assert reading.position_m is not None
        line.send(topics.POSITION, messages.position(reading.t_ns + 4000 * S, reading.position_m, 0.5))
    line.hear_all()
    told = [array.status[0].message for array in line.heard[topics.DIAGNOSTICS]]
    assert any("PositionSample" in text and "s from all others" in text for text in told)
    values = line.values()
    assert int(values["dropped.STRAY"]) >= 25
    assert values["resets"] == "0"
    assert line.estimator.latest is not None

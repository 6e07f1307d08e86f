# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The estimator as a node: live equals offline to the bit, its results agree, its parameters reach it."""

from __future__ import annotations

import math
from pathlib import Path

import messages
import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticStatus
from estimator_line import FAST, Line, S, estimating, offline_digest, samples
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core import Config, predict
from adhesion_node.core.intake.samples import PositionSample, PressureSample, SpeedSample, WheelSample
from adhesion_node.core.physics.train import GRAVITY
from adhesion_node.nodes import estimator
from adhesion_node.nodes.estimator import PARAMETERS, Estimator
from adhesion_node.nodes.ros import types
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire import topics
from adhesion_node.wire.line import ATMOSPHERE_PA
from adhesion_node.wire.settings.setup import setup_of

CURVES = (topics.BRAKING_CURVE, topics.BRAKING_CURVE_NOMINAL)


@pytest.fixture
def line(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Line:
    return estimating(context, executor, spin_until)


def test_live_equals_offline_to_the_bit(line: Line) -> None:
    readings = [reading for _, reading in samples("tunnel_entry", 15.0, 31.0)]
    for reading in readings:
        line.send_sample(reading)
    line.estimator.close()
    assert line.estimator.digest == offline_digest(readings)
    line.hear_all()
    assert line.values()["digest"] == line.estimator.digest


def test_fixes_on_a_track_line_are_positions(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, tmp_path: Path
) -> None:
    """Along a meridian, where a chainage of s m is a latitude; fixes off the line are refused and counted."""
    (tmp_path / "line.csv").write_text("lat,lon\n47,8\n47.2,8\n", encoding="utf-8")
    overrides = [Parameter("track_line", value=str(tmp_path / "line.csv"))]
    estimator = Estimator(context=context, parameter_overrides=overrides)
    line = Line(executor, spin_until, estimator, Node("driver", context=context))
    for longitude in (8.0, 8.001):
        for step in range(20):
            t_ns = S + step * S // 10 + (longitude > 8.0)
            latitude = 47.1 + step * 2.5 / 111_170.0
            line.send(topics.FIX, topics.FIX.build(types.new, t_ns, (latitude, longitude, math.nan), 0.0, "gnss"))
    line.send(topics.ODOMETRY, topics.ODOMETRY.build(types.new, 3 * S, (0.0,), 1.0))
    line.estimator.close()
    assert line.estimator.latest.position_m == pytest.approx(11_117.0 + 19 * 2.5, abs=5.0)
    line.estimator.report()
    line.hear_all()
    dropped = {key: value for key, value in line.values().items() if key.startswith("dropped.")}
    assert dropped == {"dropped.OFF_TRACK": "20", "dropped.OTHER_SOURCE": "1"}
    assert line.values()["position_source"] == "fix"
    assert "odometry" not in line.heard[topics.DIAGNOSTICS][-1].status[0].message, "a second source is no fault"


def test_other_measurements_give_another_digest() -> None:
    readings = [reading for _, reading in samples("tunnel_entry", 18.0, 24.0)]
    moved = [readings[0]._replace(position_m=(readings[0].position_m or 0.0) + 1e-9), *readings[1:]]
    assert offline_digest(readings) != offline_digest(moved)


def test_every_result_says_the_same_of_one_instant(line: Line) -> None:
    for _, reading in samples("tunnel_entry", 15.0, 28.0):
        line.send_sample(reading)
    line.hear_all()
    estimate = line.estimator.latest
    assert estimate is not None
    assert estimate.window > 0
    last = {topic: heard[-1] for topic, heard in line.heard.items()}
    assert last[topics.MU].data == estimate.mu
    assert last[topics.MU_LOWER].data == estimate.mu_lower < estimate.mu
    assert last[topics.DECELERATION].accel.accel.linear.x == pytest.approx(-GRAVITY * estimate.mu)
    assert last[topics.DECELERATION].accel.covariance[0] == pytest.approx((GRAVITY * estimate.mu_std) ** 2)
    assert last[topics.STATE].pose.pose.position.x == estimate.position_m
    assert last[topics.STATE].twist.twist.linear.x == estimate.speed_mps
    _, safe, nominal = predict(line.estimator.config, estimate)
    for topic, expected in ((topics.BRAKING_CURVE, safe), (topics.BRAKING_CURVE_NOMINAL, nominal)):
        message = last[topic]
        t_ns, _, read, _ = topics.BRAKING_CURVE.read(message)
        assert expected is not None
        assert t_ns == estimate.t_ns
        assert message.points[0].positions[0] == pytest.approx(estimate.position_m)
        assert read.distance_m == pytest.approx(expected.distance_m, rel=1e-9, abs=1e-6)
        assert read.speed_mps == pytest.approx(expected.speed_mps)
    assert (
        last[topics.BRAKING_CURVE].points[-1].positions[0] > last[topics.BRAKING_CURVE_NOMINAL].points[-1].positions[0]
    )


def test_a_combination_out_of_range_is_refused_at_start(context: Context) -> None:
    overrides = [Parameter("window", value=5), Parameter("step", value=10)]
    with pytest.raises(ValueError, match="step = 10: choose less than the window, 5"):
        Estimator(context=context, parameter_overrides=overrides, namespace="/refused")


def test_parameters_reach_the_configuration(context: Context) -> None:
    overrides = [
        Parameter("train.mass_kg", value=400_000),  # an integer on purpose
        Parameter("track", value="grade 0 2000 10"),
        Parameter("low_adhesion", value="wet"),
    ]
    node = Estimator(context=context, parameter_overrides=overrides)
    config = node.config
    assert config.train.mass_kg == 400e3
    assert config.track.sections[0].resistance(200.0) == 0.005
    assert config.low_adhesion == "wet"
    assert len({spec.name for spec in PARAMETERS}) == len(PARAMETERS)
    node.destroy_node()


def test_silence_ends_the_wait_for_a_pressure(line: Line) -> None:
    """The last positions come without a pressure, then nothing: they are used when the sensor counts as silent."""
    readings = [reading for _, reading in samples("tunnel_entry", 15.0, 16.0)]
    for reading in readings[:-2]:
        line.send_sample(reading)
    for reading in readings[-2:]:
        assert reading.position_m is not None
        line.send(topics.POSITION, messages.position(reading.t_ns, reading.position_m, 0.5))
    assert line.estimator.pipeline.accepted < len(readings)
    line.spin_until(line.executor, lambda: line.estimator.pipeline.accepted == len(readings))


@pytest.mark.parametrize("by", ["speed", "wheels"])
def test_by_speed_or_wheels_alone_and_beyond_the_node_runs_as_offline(line: Line, by: str) -> None:
    """5 s of them alone, 2 s with positions of 2 Hz, 3 s without them again: nothing is stale on them alone."""
    pipeline = Pipeline(setup_of(FAST).config, 1)
    levels = line.heard[topics.DIAGNOSTICS]
    for k in range(100):
        t_ns = S + k * S // 10
        line.send(topics.BRAKE_PRESSURE, messages.brake_pressure(t_ns, ATMOSPHERE_PA, 0.0))
        pipeline.push(PressureSample(t_ns, 0.0))
        if by == "speed":
            line.send(topics.SPEED, messages.speed(t_ns, 30.0, 0.1))
            pipeline.push(SpeedSample(t_ns, 30.0, 0.1**2))
        else:
            line.send(topics.WHEEL_SPEED, messages.wheel_speed(t_ns, [65.0, 66.0]))
            pipeline.push(WheelSample(t_ns, (65.0, 66.0)))
        if 50 <= k < 70 and k % 5 == 0:
            line.send(topics.POSITION, messages.position(t_ns, 3.0 * k, 0.5))
            pipeline.push(PositionSample(t_ns, 3.0 * k, 0.25))
        if k == 49:
            line.estimator.report()
            line.hear_all()
            assert all(message.status[0].level != DiagnosticStatus.STALE for message in levels)
            assert int(line.values()["ticks"]) >= 6
    pipeline.finish()
    line.estimator.close()
    assert line.estimator.digest == pipeline.digest
    assert line.estimator.pipeline.ticks == pipeline.ticks >= 13


def test_what_is_compiled_is_so_before_the_node_is_there(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    warmed: list[Config] = []
    monkeypatch.setattr(estimator, "warm_up", warmed.append)
    node = Estimator(context=context)
    assert warmed == [node.config]
    node.destroy_node()

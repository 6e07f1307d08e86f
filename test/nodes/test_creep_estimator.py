# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The creep estimator as a node: live equals offline to the bit, the withheld peak, bad messages counted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import messages
import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticStatus
from messages import traction_force, wheel_speed
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.creep.config import CreepConfig, Peak
from adhesion_node.core.intake.samples import ForceSample, SpeedSample, WheelSample
from adhesion_node.nodes.creep_estimator import PARAMETERS, CreepEstimator
from adhesion_node.nodes.ros import qos
from adhesion_node.run.creep_pipeline import CreepPipeline
from adhesion_node.wire import topics
from adhesion_node.wire.topic import Topic
from sim_node.slip import plant as slip
from sim_node.slip.scenario import DRY, WET, SlipScenario, find

INPUTS = topics.CREEP_INPUTS
PERIOD_S = 0.05
"""20 Hz: these tests compare runs, not accuracy."""

OUTPUTS = (*topics.CREEP_RESULTS, topics.DIAGNOSTICS)


@dataclass
class Line:
    """A creep estimator, a driver that publishes its sensors and listens to its results."""

    executor: SingleThreadedExecutor
    spin_until: SpinUntil
    estimator: CreepEstimator
    driver: Node
    heard: dict[Topic, list[Any]] = field(default_factory=lambda: {topic: [] for topic in OUTPUTS})

    def __post_init__(self) -> None:
        self.outputs = {topic: qos.advertise(self.driver, topic, qos.SENSOR_PUBLISHER) for topic in INPUTS}
        for topic, heard in self.heard.items():
            qos.subscribe(self.driver, topic, heard.append, qos.RESULT)
        self.executor.add_node(self.estimator)
        self.executor.add_node(self.driver)
        self.spin_until(self.executor, self._matched)

    def _matched(self) -> bool:
        listening = all(output.get_subscription_count() for output in self.outputs.values())
        return listening and all(self.estimator.count_subscribers(topic.name) for topic in OUTPUTS)

    def send(self, topic: Topic, message: Any) -> None:
        before = self.estimator.heard[topic]
        self.outputs[topic].publish(message)
        self.spin_until(self.executor, lambda: self.estimator.heard[topic] > before)

    def send_sample(self, measured: slip.SlipReading) -> None:
        self.send(topics.SPEED, messages.speed(measured.t_ns, measured.speed_mps, 0.003))
        self.send(topics.TRACTION_FORCE, traction_force(measured.t_ns, measured.force_n))
        self.send(topics.WHEEL_SPEED, wheel_speed(measured.t_ns, measured.wheel_radps))

    def hear_all(self) -> None:
        sent = self.estimator.published
        self.spin_until(self.executor, lambda: all(len(heard) == sent[topic] for topic, heard in self.heard.items()))

    def status(self) -> Any:
        (status,) = self.heard[topics.DIAGNOSTICS][-1].status
        return status

    def values(self) -> dict[str, str]:
        return {pair.key: pair.value for pair in self.status().values}


@pytest.fixture
def line(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Line:
    return Line(executor, spin_until, CreepEstimator(context=context), Node("driver", context=context))


@pytest.fixture(scope="module")
def readings() -> list[slip.SlipReading]:
    return [measured for _, measured in islice(slip.run(find("creep_dry"), PERIOD_S, 1), 380)]


def offline(readings: list[slip.SlipReading]) -> CreepPipeline:
    pipeline = CreepPipeline(CreepConfig())
    for measured in readings:
        for sample in (
            SpeedSample(measured.t_ns, measured.speed_mps),
            ForceSample(measured.t_ns, measured.force_n),
            WheelSample(measured.t_ns, measured.wheel_radps),
        ):
            pipeline.push(sample)
    pipeline.finish()
    pipeline.finish()
    return pipeline


def test_live_equals_offline_to_the_bit(line: Line, readings: list[slip.SlipReading]) -> None:
    for measured in readings:
        line.send_sample(measured)
    line.estimator.close()
    line.hear_all()
    alone = offline(readings)
    assert line.estimator.digest == alone.digest
    assert line.values()["digest"] == alone.digest
    estimate = line.estimator.latest
    assert estimate == alone.last
    assert estimate is not None
    assert estimate.known
    assert line.heard[topics.CREEP_MU_MAX][-1].data == estimate.mu_max == pytest.approx(0.35, rel=0.05)
    assert line.heard[topics.CREEP_LAMBDA_M][-1].data == estimate.lambda_m
    assert line.status().level == DiagnosticStatus.OK
    values = line.values()
    assert float(values["mu_max_lower"]) < estimate.mu_max < float(values["mu_max_upper"])
    assert {"p1", "p2", "p1_std", "p2_std", "samples", "remembered", "eta"} <= set(values)


def test_the_peak_is_withheld_while_the_data_cannot_tell_it(line: Line, readings: list[slip.SlipReading]) -> None:
    for measured in readings[:160]:
        line.send_sample(measured)
    line.hear_all()
    assert line.heard[topics.CREEP_MU_MAX] == line.heard[topics.CREEP_LAMBDA_M] == []
    assert len(line.heard[topics.DIAGNOSTICS]) > 5
    assert line.status().level == DiagnosticStatus.WARN
    assert line.status().message.startswith("withheld: ")
    values = line.values()
    assert values["withheld"] == "true"
    assert values["peak"] in {status.name for status in Peak} - {Peak.KNOWN.name}


def test_bad_messages_are_counted_said_and_change_nothing(line: Line, readings: list[slip.SlipReading]) -> None:
    for index, measured in enumerate(readings[:80]):
        line.send_sample(measured)
        if index == 40:
            for topic, message in bad_messages(measured.t_ns + 1):
                line.send(topic, message)
    line.hear_all()
    drops = {key: value for key, value in line.values().items() if key.startswith("dropped.")}
    del drops["dropped.IDLE"]
    assert drops == {
        "dropped.NOT_FINITE": "2",
        "dropped.NO_AXLE": "2",
        "dropped.IMPLAUSIBLE_WHEEL_SPEED": "1",
        "dropped.IMPLAUSIBLE_FORCE": "1",
        "dropped.IMPLAUSIBLE_SPEED": "1",
    }
    assert line.estimator.digest == offline(readings[:80]).digest
    said = [message.status[0].message for message in line.heard[topics.DIAGNOSTICS]]
    assert any("message refused: traction force x = 1e+08: force.x is in N, within +-1e+07" in text for text in said)


def bad_messages(t_ns: int) -> Iterator[tuple[Topic, Any]]:
    yield topics.TRACTION_FORCE, traction_force(t_ns, float("nan"))
    yield topics.TRACTION_FORCE, traction_force(t_ns, 1e8)
    yield topics.WHEEL_SPEED, wheel_speed(t_ns, ())
    nameless = wheel_speed(t_ns, (16.0,) * 6)
    nameless.name = ["axle_1"]
    yield topics.WHEEL_SPEED, nameless
    yield topics.WHEEL_SPEED, wheel_speed(t_ns, (16.0, float("inf")))
    yield topics.WHEEL_SPEED, wheel_speed(t_ns, (16.0, 5000.0))
    yield topics.SPEED, messages.speed(t_ns, 1e4, 0.1)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"wheel_radps": (12.8,) * 5}, "AXLES"),
        ({"wheel_radps": (14.0, 12.8, 12.8, 12.8, 12.8, 12.8)}, "UNEQUAL"),
        ({"speed_mps": 0.2}, "SLOW"),
    ],
)
def test_a_pair_that_gives_no_creep_is_counted(changed: dict[str, Any], reason: str) -> None:
    measured = slip.SlipReading(10**9, (12.8,) * 6, 8.0, 1e5)._replace(**changed)
    assert offline([measured]).dropped == {reason: 1}


def test_wheel_speeds_alone_are_counted_as_unpaired() -> None:
    pipeline = CreepPipeline(CreepConfig())
    pipeline.push(WheelSample(10**9, (12.8,) * 6))
    assert pipeline.finish() == []
    assert pipeline.dropped == {"UNPAIRED": 1}


def test_the_surface_switch_is_followed() -> None:
    """Dry, then wet, at 50 Hz: either peak within 3 % at the end of its surface."""
    scenario = SlipScenario("short", ((0.0, DRY), (180.0, WET)), 38.0)
    known: dict[float, float] = {}
    pipeline = CreepPipeline(CreepConfig())
    for truth, measured in slip.run(scenario, 0.02, 1):
        samples = (
            SpeedSample(measured.t_ns, measured.speed_mps),
            ForceSample(measured.t_ns, measured.force_n),
            WheelSample(measured.t_ns, measured.wheel_radps),
        )
        for estimate in (estimate for sample in samples for estimate in pipeline.push(sample) if estimate.known):
            known[round(truth.mu_max, 6)] = estimate.mu_max
    assert known[0.35] == pytest.approx(0.35, rel=0.03)
    assert known[0.2] == pytest.approx(0.2, rel=0.03)


def test_parameters_reach_the_configuration_and_bad_ones_are_refused(context: Context) -> None:
    overrides = [Parameter("axle_load_kg", value=20_000), Parameter("forgetting", value="fixed")]
    node = CreepEstimator(context=context, parameter_overrides=overrides)
    assert node.get_parameter("axle_load_kg").value == 20_000.0
    assert len({spec.name for spec in PARAMETERS}) == len(PARAMETERS)
    node.destroy_node()
    bad = [Parameter("eta_min", value=0.99), Parameter("eta_max", value=0.98)]
    with pytest.raises(ValueError, match=r"eta_min = 0.99: choose at most eta_max, 0.98"):
        CreepEstimator(context=context, parameter_overrides=bad, namespace="/refused")


def test_readers_take_good_messages() -> None:
    assert topics.WHEEL_SPEED.read(wheel_speed(5, (1.0, -2.0))) == (5, (1.0, -2.0))
    assert topics.TRACTION_FORCE.read(traction_force(7, -3.0)) == (7, -3.0)

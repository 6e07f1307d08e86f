# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`replay --offline` of a creep recording: what it reports, and the digest of the live node."""

from __future__ import annotations

import json
from itertools import islice
from pathlib import Path
from typing import Any

import cdrs
import messages
import pytest
from conftest import SpinUntil
from messages import traction_force, wheel_speed
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message

from adhesion_node.bag import BagWriter
from adhesion_node.core.creep.config import Peak
from adhesion_node.nodes import replay
from adhesion_node.nodes.creep_estimator import CreepEstimator
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from adhesion_node.wire.topic import Topic
from sim_node.slip import plant as slip
from sim_node.slip.scenario import find

SAMPLES = 380
"""At 20 Hz: up to the peak of the dry rail."""


def recorded(count: int = SAMPLES) -> list[tuple[Topic, int, Any]]:
    """The sensor messages of a pull, with two that must not be used."""
    stream: list[tuple[Topic, int, Any]] = []
    for _, measured in islice(slip.run(find("creep_dry"), 0.05, 1), count):
        stream += [
            (topics.SPEED, measured.t_ns, messages.speed(measured.t_ns, measured.speed_mps, 0.003)),
            (topics.TRACTION_FORCE, measured.t_ns, traction_force(measured.t_ns, measured.force_n)),
            (topics.WHEEL_SPEED, measured.t_ns, wheel_speed(measured.t_ns, measured.wheel_radps)),
        ]
    late = stream[-1][1] + 1
    return [*stream, (topics.TRACTION_FORCE, late, traction_force(late, 1e9)), (*stream[-1][:1], late, stream[-1][2])]


def write(folder: Path, stream: list[tuple[Topic, int, Any]], *, position: bool = False) -> Path:
    with BagWriter(folder) as writer:
        for topic, t_ns, message in stream:
            writer.write(f"/{topic.name}", topic.type, bytes(serialize_message(message)), t_ns)
            if position and topic == topics.WHEEL_SPEED:
                place = cdrs.position(t_ns, 8e-9 * t_ns, 0.25)
                writer.write(f"/{topics.POSITION.name}", topics.POSITION.type, place, t_ns)
    return folder


def offline(bag: Path, *options: str, code: int = 0) -> dict[str, Any]:
    file = bag.with_suffix(".json")
    assert replay.main([str(bag), "--offline", "--json", str(file), *options]) == code
    result: dict[str, Any] = json.loads(file.read_text())
    return result


def test_the_peak_and_the_drops_are_reported(tmp_path: Path) -> None:
    result = offline(write(tmp_path / "bag", recorded()))
    assert result["mu_max"] == pytest.approx(0.35, rel=0.05)
    assert result["mu_max_lower"] < result["mu_max"] < result["mu_max_upper"]
    assert result["lambda_m"] == pytest.approx(result["p2"] ** -0.5)
    assert result["mu_max"] == pytest.approx(20.0 / (result["p1"] + 2.0 * result["p2"] ** 0.5))
    assert (result["peak"], result["withheld"]) == ("KNOWN", None)
    idle = result["dropped"].pop("IDLE")
    assert result["dropped"] == {"DUPLICATE": 1, "IMPLAUSIBLE_FORCE": 1}
    assert result["samples"] == SAMPLES - idle


def test_a_withheld_peak_is_none_and_says_why(tmp_path: Path) -> None:
    result = offline(write(tmp_path / "bag", recorded(160)))
    assert result["mu_max"] is result["lambda_m"] is result["mu_max_lower"] is None
    assert result["withheld"] == Peak[result["peak"]].value
    assert result["p1"] > 0.0


def test_live_and_offline_give_one_digest(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    stream = recorded()
    node = CreepEstimator(context=context, parameter_overrides=[Parameter("every", value=7)])
    driver = Node("driver", context=context)
    outputs = {topic: qos.advertise(driver, topic, qos.SENSOR_PUBLISHER) for topic in topics.CREEP_INPUTS}
    for each in (node, driver):
        executor.add_node(each)
    spin_until(executor, lambda: all(output.get_subscription_count() for output in outputs.values()))

    def send(topic: Topic, message: Any) -> None:
        before = node.heard.total()
        outputs[topic].publish(message)
        spin_until(executor, lambda: node.heard.total() > before)

    for topic, _, message in stream:
        send(topic, message)
    node.close()
    bag = write(tmp_path / "bag", stream)
    assert offline(bag, "--set", "every=7")["digest"] == node.digest
    assert offline(bag)["digest"] != node.digest


def test_settings_come_from_a_parameter_file_too(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", recorded(160))
    file = tmp_path / "creep.yaml"
    file.write_text("creep_estimator: {ros__parameters: {every: 7, axle_load_kg: 2.0e4}}\n")
    expected = offline(bag, "--set", "every=7", "--set", "axle_load_kg=20000")
    assert offline(bag, "--params", str(file)) == expected


def test_with_positions_the_estimator_is_chosen_by_name(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", recorded(160), position=True)
    alone = write(tmp_path / "alone", recorded(160))
    assert offline(bag, "--estimator", "creep") == offline(alone) == offline(alone, "--estimator", "creep")
    assert offline(bag, code=1)["measurements"] == 161  # its bare positions identify nothing of the rail


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--seed", "2"], "--seed 2: the creep identification draws nothing: leave it out"),
        (["--train", "metro"], "--train metro: the locomotive of the creep identification is told by --set"),
        (
            ["--set", "particles=20"],
            "setting 'particles=20': write NAME=VALUE with one of sensor_timeout_s, use_speed,",
        ),
        (["--set", "eta_min=2"], "eta_min = 2.0: give a value from 0.5 to 1"),
        (
            ["--estimator", "adhesion", "--topics", "traction_force"],
            "holds no position or odometry or speed or wheel_speed, without which nothing is identified",
        ),
    ],
)
def test_bad_input_is_one_line_and_code_2(
    options: list[str], message: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bag = write(tmp_path / "bag", recorded(20))
    assert replay.main([str(bag), "--offline", *options]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert message in line


@pytest.mark.parametrize(
    ("held", "lacking"),
    [
        (["speed"], "traction_force and no wheel_speed"),
        (["wheel_speed", "speed"], "traction_force"),
        (["wheel_speed", "traction_force"], "speed"),
    ],
)
def test_a_bag_without_what_makes_creep_says_so(
    held: list[str], lacking: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bag = write(tmp_path / "bag", recorded(20), position=True)
    assert replay.main([str(bag), "--offline", "--estimator", "creep", "--topics", *held]) == 2
    assert f"holds no {lacking}, without which there is no creep" in capfd.readouterr().err


def test_where_nothing_is_identified_it_is_said_why(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A locomotive that is slower than the setting all the way."""
    bag = write(tmp_path / "bag", recorded(160))
    offline(bag, "--set", "min_speed_mps=50", code=1)
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("replay: nothing is identified: 160 messages were dropped: SLOW: slower than min_speed_mps")

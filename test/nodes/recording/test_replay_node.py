# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Replay to topics: every byte arrives, /clock rises, pace, remapping, what is missing, what is refused."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import cdrs
import pytest
from conftest import SpinUntil
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from recorded import write_steps
from replays import UNLIMITED, Listener, S, of
from rosbags.rosbag2 import StoragePlugin, Writer
from test_replay_waits import turned_by_hand

from adhesion_node.bag import BagReader, BagWriter, select, serialize, typestore
from adhesion_node.bag.types import Definition
from adhesion_node.command.options import DONE
from adhesion_node.nodes import replay
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.ros import runtime
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_PRESSURE, MU, POSITION, TRUTH_MU


@pytest.mark.parametrize("rate", [0.0, 20.0])
def test_every_byte_arrives_and_the_clock_rises(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, rate: float
) -> None:
    """At 20 times real time a machine that was busy for half a second catches up by more than a queue of 100 holds."""
    written = write_steps(tmp_path / "bag", 400)
    listener = Listener(context, POSITION, BRAKE_PRESSURE, profile=UNLIMITED)
    executor.add_node(listener)
    with BagReader(tmp_path / "bag") as reader:
        node = Replay(reader, select(reader.topics), rate, context=context)
        executor.add_node(node)
        spin_until(executor, lambda: len(listener.heard) == len(written) and len(listener.clock) == 400)
        spin_until(executor, lambda: node.finished)
    assert node.failure is None
    assert listener.of(POSITION) == of(written, "/position")
    assert listener.of(BRAKE_PRESSURE) == of(written, "/brake_pressure")
    assert listener.clock == [step * S // 10 for step in range(400)]
    assert node.published == {"/position": 400, "/brake_pressure": 400}


def test_the_rate_is_kept(tmp_path: Path, context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ticks of 10 ms: a step every 25 ms of a clock that the test turns."""
    now_ms = turned_by_hand(monkeypatch)
    write_steps(tmp_path / "bag", 21)  # 2 s
    with BagReader(tmp_path / "bag") as reader:
        node = Replay(reader, select(reader.topics), 4.0, subscribers=0, context=context)
        node.tick()
        published = []
        for now_ms[0] in range(5001, 5511, 10):
            node.tick()
            published.append(node.published["/position"])
        node.destroy_node()
    assert published == [1 + (10 * tick + 1) // 25 for tick in range(50)] + [21]
    assert node.finished


def test_recorded_results_are_not_replayed_and_truth_is(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for step in range(3):
            writer.write("/truth/mu", MU.type, serialize(typestore().types[MU.type](data=0.1), MU.type), step)
            writer.write("/adhesion/mu", MU.type, serialize(typestore().types[MU.type](data=0.2), MU.type), step)
            writer.write("/position", POSITION.type, cdrs.position(step, 1.0, 1.0), step)
    listener = Listener(context, POSITION, TRUTH_MU, MU)
    executor.add_node(listener)
    with BagReader(tmp_path / "bag") as reader:
        node = Replay(reader, select(reader.topics), 0.0, context=context)
        executor.add_node(node)
        spin_until(executor, lambda: node.finished and len(listener.heard) >= 6)
    assert (len(listener.of(POSITION)), len(listener.of(TRUTH_MU)), len(listener.of(MU))) == (3, 3, 0)


def test_names_follow_the_remapping_and_the_namespace(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    path = tmp_path / "elsewhere"
    positions = [cdrs.position(step, float(step), 1.0) for step in range(5)]
    with Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as foreign:
        connection = foreign.add_connection("/odometry/position", POSITION.type, typestore=typestore())
        for step, cdr in enumerate(positions):
            foreign.write(connection, step, cdr)
    listener = Listener(context, Topic("/train2/position", POSITION.type))
    executor.add_node(listener)
    with BagReader(path) as reader:
        selection = select(reader.topics, [("odometry/position", "position")])
        node = Replay(reader, selection, 0.0, context=context, namespace="/train2")
        executor.add_node(node)
        spin_until(executor, lambda: node.finished and len(listener.heard) == 5)
    assert [cdr for _, cdr in listener.heard] == positions


@pytest.mark.parametrize("rate", [-1.0, float("nan"), float("inf")])
def test_a_bad_rate_is_refused(tmp_path: Path, context: Context, rate: float) -> None:
    write_steps(tmp_path / "bag", 1)
    with (
        BagReader(tmp_path / "bag") as reader,
        pytest.raises(ValueError, match=r"rate = .*: give a factor above 0, or 0"),
    ):
        Replay(reader, {"/position": "position"}, rate, context=context)


def test_a_bag_without_position_says_what_there_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        writer.write("/gnss", POSITION.type, cdrs.position(0, 0.0, 1.0), 0)
    assert replay.main([str(tmp_path / "bag")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == (
        f"replay: bag = {tmp_path / 'bag'}: topic position: not in the recording. "
        f"It holds: /gnss ({POSITION.type}). Name the right one, for instance --remap /gnss:=position"
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--remap", "position"], "remap = 'position': write FROM:=TO"),
        (["--remap", "/nothing:=position"], "remap from /nothing: not in the recording. It holds: "),
        (["--remap", "/brake_pressure:=position"], "topic /brake_pressure: type = sensor_msgs/msg/FluidPressure: "),
        (["--topics", "wheel_speed"], "topic wheel_speed: not in the recording"),
        (["--rate", "-1"], "rate = -1.0: give a factor above 0, or 0"),
        (["--wait-for-subscribers", "-1"], "wait-for-subscribers = -1: give at least 0"),
        (["--set", "a=1"], "--set a=1: is for --offline: add that, or start the live estimator of your choice"),
        (["--params", "p.yaml"], "--params p.yaml: is for --offline"),
        (["--train", "metro"], "--train metro: is for --offline"),
        (["--node", "estimator"], "--node estimator: is for --offline"),
        (["--seed", "0"], "--seed 0: is for --offline"),
        (["--estimator", "creep"], "--estimator creep: is for --offline"),
    ],
)
def test_what_does_not_fit_is_one_line_and_code_2(
    tmp_path: Path, options: list[str], message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    write_steps(tmp_path / "bag", 2)
    assert replay.main([str(tmp_path / "bag"), *options]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert message in line


def test_messages_of_others_need_their_workspace(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/foo", "my_msgs/msg/Foo", known_as=Definition("ros2msg", "int32 bar"))
        writer.write("/foo", "my_msgs/msg/Foo", b"\0\1\0\0\7\0\0\0", 0)
    assert replay.main([str(tmp_path / "bag"), "--topics", "/foo"]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    remedy = "my_msgs is missing: source the workspace that has it"
    assert line == f"replay: message type = my_msgs/msg/Foo: {remedy}"


def test_an_unreadable_bag_is_one_line_and_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.mcap").write_bytes(b"garbage")
    assert replay.main([str(tmp_path / "x.mcap")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "x.mcap: is not an MCAP file: name another recording" in line


def test_a_signal_before_the_node_is_there_is_a_clean_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_steps(tmp_path / "bag", 2)
    monkeypatch.setattr(runtime, "run", lambda *_: DONE)
    assert replay.main([str(tmp_path / "bag")]) == DONE


def test_offline_needs_no_ros() -> None:
    code = """
import sys
from adhesion_node.nodes import replay
replay.main(["--offline", "nowhere.mcap"])
assert "rclpy" not in sys.modules
"""
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "Traceback" not in shown.stderr
    assert "nowhere.mcap: does not exist" in shown.stderr

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A recording in simulated time begins with that time, whatever the nodes say before it."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import SpinUntil
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from recorders import S, clock, simulated, stamped, start

from adhesion_node.bag import BagReader, select_from
from adhesion_node.nodes import recorder, waiting
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.wire.topics import ATP_STATUS, CLOCK, MU, POSITION
from sim_node.nodes.simulator import Simulator


def test_what_comes_before_the_first_clock_gets_its_stamp_or_that_clock(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """A stamp of another time is none: of a node that waits for /clock, or goes by the machine's."""
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [POSITION, MU], sim=True)
    stamps = {"uptime": 9, "just before": 999 * S, "machine": 1_790_000_000 * S, "old": 900 * S, "same": 1000 * S}
    for stamp_ns in stamps.values():
        ends[POSITION].publish(stamped(POSITION, stamp_ns))
    ends[MU].publish(stamped(MU, 0))
    spin_until(executor, lambda: (recording.heard[POSITION], recording.heard[MU]) == (5, 1))
    for _ in range(2 * recorder.ROUNDS):
        recording.save()
    assert not recording.counts["/train1/position"]
    for second in (1000, 1001):
        ends[CLOCK].publish(clock(second * S))
    ends[POSITION].publish(stamped(POSITION, 1001 * S))
    spin_until(executor, lambda: (recording.heard[POSITION], recording.heard[CLOCK]) == (6, 2))
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        logged = {
            record.message.header.stamp.sec: record.log_ns / S for record in reader.messages(["/train1/position"])
        }
        assert [record.log_ns / S for record in reader.messages(["/train1/adhesion/mu"])] == [1000]
    assert logged == {0: 1000, 999: 999, 1_790_000_000: 1000, 900: 1000, 1000: 1000, 1001: 1001}


def test_a_line_whose_simulator_comes_last_plays_from_its_first_second(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    recording = Recorder(tmp_path / "bag", context=context, parameter_overrides=simulated())
    hasty = [*simulated(), Parameter("clock_timeout_s", value=0.2)]
    monitor = AtpMonitor(context=context, parameter_overrides=hasty)
    for node in (recording, monitor):
        executor.add_node(node)
    spin_until(executor, lambda: recording.heard[ATP_STATUS] >= 3)
    happening = [Parameter("wait_for", value=1), Parameter("real_time_factor", value=10.0)]
    simulator = Simulator(context=context, parameter_overrides=happening)
    executor.add_node(simulator)
    spin_until(executor, lambda: recording.heard[POSITION] >= 20)
    recording.close()
    start_ns = round(simulator.values["start_time_s"] * S)
    for ended in tuple(executor.get_nodes()):
        executor.remove_node(ended)
        ended.destroy_node()
    with BagReader(tmp_path / "bag") as reader:
        times = [record.log_ns for record in reader.messages()]
        assert abs(times[0] - start_ns) < S
        player = Replay(reader, select_from(reader, []), subscribers=0, context=context)
        executor.add_node(player)
        spin_until(executor, lambda: player.published["/position"] >= 5)


def test_what_waits_for_a_clock_is_bounded(
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(waiting, "HELD", 5)
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [POSITION], sim=True)
    for number in range(8):
        ends[POSITION].publish(stamped(POSITION, (number + 1) * S))
    spin_until(executor, lambda: recording.heard[POSITION] == 8)
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        assert [record.log_ns // S for record in reader.messages()] == [4, 5, 6, 7, 8]
    assert "no /clock: of 5 messages that wait for it the oldest is given up" in capfd.readouterr().err

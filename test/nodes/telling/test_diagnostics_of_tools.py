# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What /diagnostics tell of recorder, player, page and simulators."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import messages
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from recorded import write_steps
from told_line import Line, S, beside, make_line

from adhesion_node.bag import BagReader, select
from adhesion_node.live.node import Live
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.wire import topics
from sim_node.nodes.simulator import Simulator
from sim_node.nodes.slip_simulator import SlipSimulator

__all__ = ["beside", "make_line"]


def test_the_recorder_tells_what_it_has_written(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]], tmp_path: Path
) -> None:
    line = make_line(beside[Recorder], diagnostics_period_s=0.1)
    line.outlet(topics.MU).publish(messages.mu_message(0.08))
    line.wait(lambda: line.node.counts.get("/adhesion/mu") == 1)
    line.wait(lambda: line.told and int(line.values["written"]) > 0)
    assert int(line.values["bytes"]) > 0
    assert line.last.level == DiagnosticStatus.OK
    assert Path(line.values["file"]).parent == tmp_path / "bag"
    assert Path(line.values["file"]).exists()
    assert 0 < int(line.values["written"]) <= sum(line.node.counts.values())
    assert line.values["dropped"] == "0"


def test_the_recorder_tells_that_there_is_no_clock(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]]
) -> None:
    line = make_line(beside[Recorder], diagnostics_period_s=0.1, use_sim_time=True)
    line.wait_until_said("no /clock yet")
    assert line.last.level == DiagnosticStatus.WARN
    line.outlet(topics.CLOCK).publish(messages.clock(1000 * S))
    line.wait(lambda: line.last.level == DiagnosticStatus.OK)


def test_the_player_tells_how_much_is_left(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]]
) -> None:
    line = make_line(beside[Replay], diagnostics_period_s=0.1)
    line.wait_until_said("the end of the recording")
    assert (line.values["published"], line.values["left"], line.values["next_ns"]) == ("80", "0", "none")


def test_a_player_that_waits_tells_for_whom(make_line: Callable[..., Line], tmp_path: Path) -> None:
    write_steps(tmp_path / "bag", 3)
    with BagReader(tmp_path / "bag") as reader:
        line = make_line(partial(Replay, reader, select(reader.topics)), diagnostics_period_s=0.1)
        line.wait_until_said("waiting for 1 subscriber(s) to /position")
    assert (line.values["published"], line.values["left"]) == ("0", "6")


def test_the_page_tells_who_looks_and_how_old_is_what_it_shows(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]]
) -> None:
    line = make_line(beside[Live], diagnostics_period_s=0.1)
    line.wait_for_values(viewers="0")
    assert line.last.message == f"open {line.node.server.url}"
    assert "age_s.adhesion/mu" not in line.values
    line.outlet(topics.MU).publish(messages.mu_message(0.08))
    line.wait(lambda: "age_s.adhesion/mu" in line.values)
    assert 0.0 <= float(line.values["age_s.adhesion/mu"]) < 10.0


@pytest.mark.parametrize(
    ("fault", "begins_s", "active"), [("loss", 0.0, True), ("loss", 1e5, False), ("mass", 0.0, True)]
)
def test_the_simulator_tells_its_fault(
    make_line: Callable[..., Line], fault: str, begins_s: float, active: bool
) -> None:
    line = make_line(Simulator, diagnostics_period_s=0.1, fault=fault, fault_start_s=begins_s)
    line.wait(lambda: line.told and int(line.values["samples"]) > 1)
    assert line.last.level == (DiagnosticStatus.WARN if active else DiagnosticStatus.OK)
    assert (f"fault {fault}" in line.last.message) is active
    assert (line.values["fault"], line.values["fault_active"]) == (fault, str(active).lower())
    assert line.values["scenario"] == "tunnel_entry"
    assert float(line.values["simulated_s"]) > 1000.0


def test_a_simulator_that_waits_tells_for_whom(make_line: Callable[..., Line]) -> None:
    line = make_line(SlipSimulator, diagnostics_period_s=0.1, wait_for=1)
    line.wait_until_said("waiting for 1 subscriber(s) to wheel_speed")
    assert line.values["samples"] == "0"

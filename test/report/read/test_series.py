# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Series out of a recording: which time counts, what is missing, interpolation between."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cdrs
import messages
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64

from adhesion_node.bag import BagReader, BagWriter
from adhesion_node.core.atp.received import TrainState
from adhesion_node.report.read.gathered import Numbers, read_status
from adhesion_node.report.read.messages import read_topics
from adhesion_node.report.read.series import Series
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import ATP_STATUS, DIAGNOSTICS, MU, MU_LOWER, POSITION, STATE

S = 10**9


def write(path: Path, *rows: tuple[Topic, Any, int]) -> Path:
    """Write messages with their log times."""
    with BagWriter(path) as writer:
        for topic, message, log_ns in rows:
            writer.write(f"/{topic.name.lstrip('/')}", topic.type, serialize_message(message), log_ns)
    return path


def state(t_ns: int, speed_mps: float) -> Any:
    return messages.state_message(t_ns, 0.0, 1.0, speed_mps, 1.0)


def speed_of(state: TrainState) -> float:
    return state.speed_mps


def read_series(reader: BagReader, topic: Topic, value: Callable[[Any], Any] = lambda read: read) -> Series:
    """Gather `value` of all that is read of a topic."""
    numbers = Numbers(value)
    read_topics(reader, [(topic, numbers.take)])
    return numbers.series


def test_the_stamp_counts_before_the_log_time(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", (STATE, state(S, 80.0), 5 * S), (STATE, state(2 * S + 1, 79.0), 6 * S))
    with BagReader(path) as reader:
        series = read_series(reader, STATE, speed_of)
    assert series.t_ns.dtype == np.int64
    assert series.t_ns.tolist() == [S, 2 * S + 1]
    assert series.values.tolist() == [80.0, 79.0]


def test_without_a_header_the_log_time_counts(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", (MU, Float64(data=0.08), 5 * S), (MU, Float64(data=0.09), 7 * S))
    with BagReader(path) as reader:
        series = read_series(reader, MU)
    assert (series.t_ns.tolist(), series.values.tolist()) == ([5 * S, 7 * S], [0.08, 0.09])


def test_times_increase_even_where_messages_came_late(tmp_path: Path) -> None:
    path = tmp_path / "bag"
    with BagWriter(path) as writer:
        for t_ns, log_ns in ((S, S), (3 * S, 2 * S), (2 * S, 3 * S), (4 * S, 4 * S)):
            writer.write("/position", POSITION.type, cdrs.position(t_ns, t_ns / S, 1.0), log_ns)
    with BagReader(path) as reader:
        series = read_series(reader, POSITION, lambda sample: sample.position_m)
    assert (series.t_ns.tolist(), series.values.tolist()) == ([S, 2 * S, 3 * S, 4 * S], [1.0, 2.0, 3.0, 4.0])


def test_only_the_topic_that_was_asked_for(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", (MU, Float64(data=0.08), S), (MU_LOWER, Float64(data=0.05), S))
    with BagReader(path) as reader:
        assert read_series(reader, MU_LOWER).values.tolist() == [0.05]


def test_a_topic_that_is_not_there_is_empty(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", (MU, Float64(data=0.08), S))
    with BagReader(path) as reader:
        series = read_series(reader, STATE, speed_of)
    assert (series.t_ns.size, series.values.size) == (0, 0)
    assert series.t_ns.dtype == np.int64


def test_values_between_are_interpolated_and_held_beyond() -> None:
    series = Series(np.array([10, 20, 40]), np.array([1.0, 2.0, 0.0]))
    assert series.at(np.array([0, 10, 15, 30, 40, 99])) == pytest.approx([1.0, 1.0, 1.5, 1.0, 0.0, 0.0])


def test_nanoseconds_of_today_are_exact_enough() -> None:
    now_ns = 1_700_000_000 * S
    series = Series(np.array([now_ns, now_ns + S]), np.array([0.0, 1.0]))
    assert series.at(np.array([now_ns + S // 4])) == pytest.approx([0.25], abs=1e-6)


def test_a_status_is_read_by_its_key(tmp_path: Path) -> None:
    def array(t_ns: int, *pairs: tuple[str, str]) -> Any:
        others = DiagnosticStatus(name="other", values=[KeyValue(key="rate", value="10")])
        ours = DiagnosticStatus(name="ours", values=[KeyValue(key=key, value=value) for key, value in pairs])
        return DiagnosticArray(header=messages.header(t_ns), status=[others, ours])

    path = write(
        tmp_path / "bag",
        (DIAGNOSTICS, array(S, ("mu", "0.08"), ("regime", "COASTING")), 2 * S),
        (DIAGNOSTICS, array(3 * S, ("mu", "0.09")), 4 * S),
        *(
            (DIAGNOSTICS, array(1000 * S, ("regime", "COASTING"), ("stamp_ns", odd)), 5 * S)
            for odd in ("none", "", "soon", "1e9", str(2**63))
        ),
        (DIAGNOSTICS, array(1000 * S, ("regime", "BRAKE_LIMITED"), ("stamp_ns", str(5 * S))), 6 * S),
        (ATP_STATUS, array(7 * S, ("regime", "of another topic")), 7 * S),
    )
    with BagReader(path) as reader:
        regimes = read_status(reader, DIAGNOSTICS, "regime")
        assert read_status(reader, DIAGNOSTICS, "rate").values.tolist() == ["10"] * 8
    assert regimes.values.tolist() == ["COASTING", "BRAKE_LIMITED"]
    assert regimes.t_ns.tolist() == [S, 5 * S], "whatever the clock of the node that tells"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A recording of a train that slows down from 80 m/s by 2 m/s², with what was identified of it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import cdrs
import messages
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64

from adhesion_node.bag import BagReader, BagWriter
from adhesion_node.core.physics.train import Train
from adhesion_node.report.drawn import picture
from adhesion_node.report.read.recorded import read_run
from adhesion_node.report.read.run import Run
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_PRESSURE, DIAGNOSTICS, MU, MU_LOWER, STATE, TRUTH_MU, TRUTH_STATE

S = 10**9
START_NS = 1_700_000_000 * S

FREE = Train(resistance_c0=0.0, resistance_c1=0.0, resistance_c2=0.0)
"""Rolls without resistance, so that distances have a closed form."""

TRUTH = (TRUTH_MU, TRUTH_STATE)


def rows(second: int, space: str = "", **told: str) -> list[tuple[Topic, bytes]]:
    """Return a second of a run: 20 s from 80 m/s at 2 m/s^2, true adhesion 0.1, 0.09 identified, at least 0.08."""
    t_ns = START_NS + second * S
    speed, place = 80.0 - 2.0 * second, 80.0 * second - second**2
    regime = "COASTING" if second < 5 else "ADHESION_LIMITED"
    values = [KeyValue(key=key, value=value) for key, value in {"regime": regime, **told}.items()]
    status = DiagnosticStatus(name=f"{space}/estimator/adhesion".lstrip("/"), values=values)
    plain: tuple[tuple[Topic, Any], ...] = (
        (TRUTH_STATE, messages.state_message(t_ns, place, 0.0, speed, 0.0)),
        (TRUTH_MU, Float64(data=0.1)),
        (MU, Float64(data=0.09)),
        (MU_LOWER, Float64(data=0.08)),
        (STATE, messages.state_message(t_ns, place, 1.0, speed, 1.0)),
        (DIAGNOSTICS, DiagnosticArray(header=messages.header(t_ns), status=[status])),
    )
    pressure = BRAKE_PRESSURE, cdrs.brake_pressure(t_ns, 101_325.0 + 410e3)
    return [pressure, *((topic, serialize_message(message)) for topic, message in plain)]


def record(path: Path, *left_out: Topic, seconds: int = 20, namespaces: Sequence[str] = ("",)) -> Path:
    """Record a run, or the same of several trains."""
    with BagWriter(path) as writer:
        for second, space in product(range(seconds), namespaces):
            for topic, cdr in rows(second, space):
                if topic not in left_out:
                    name = topic.name if topic is DIAGNOSTICS else f"{space}/{topic.name}"
                    writer.write(name, topic.type, cdr, START_NS + second * S)
    return path


def read(path: Path) -> Run:
    with BagReader(path) as reader:
        return read_run(reader)


@pytest.fixture
def recorded(tmp_path: Path) -> Run:
    return read(record(tmp_path / "bag"))


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the pictures of a report, a second each, where the test is of its page, words or rows."""
    monkeypatch.setattr(picture, "draw", lambda *_: None)

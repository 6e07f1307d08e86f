# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is read of a recorded run: its own series, whatever else was recorded, lost or refused."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import messages
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import serialize_message
from slowing import FREE, START_NS, S, read, recorded, rows
from std_msgs.msg import Float64

from adhesion_node.bag import BagWriter
from adhesion_node.report.found.distances import distances
from adhesion_node.report.read.run import Run
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import DECELERATION, DIAGNOSTICS, MU, MU_LOWER, STATE

__all__ = ["recorded"]


def test_a_state_that_is_refused_is_no_estimate(tmp_path: Path) -> None:
    """One that is not finite ended the report: "braking curve speed_mps = nan"."""
    refused = serialize_message(messages.state_message(START_NS + 7 * S, math.nan, 1.0, 50.0, 1.0))
    with BagWriter(tmp_path / "bag") as writer:
        for second in range(20):
            for topic, cdr in rows(second):
                odd = topic is STATE and second == 7
                writer.write(f"/{topic.name.lstrip('/')}", topic.type, refused if odd else cdr, START_NS + second * S)
    run = read(tmp_path / "bag")
    assert run.speed.t_ns.tolist() == [START_NS + second * S for second in range(20) if second != 7]
    assert run.position.t_ns.tolist() == run.speed.t_ns.tolist()
    assert np.isfinite(distances(run, 0.0, FREE).identified).all()


def test_what_the_estimators_of_other_trains_tell_is_left_out(tmp_path: Path) -> None:
    """/diagnostics is shared; a regime of theirs at the same stamp took the place of ours."""
    with BagWriter(tmp_path / "bag") as writer:
        for second in range(20):
            for topic, cdr in rows(second):
                writer.write(f"/{topic.name.lstrip('/')}", topic.type, cdr, START_NS + second * S)
            writer.write(
                "/diagnostics", DIAGNOSTICS.type, told("train_b/estimator/adhesion", second), START_NS + second * S
            )
    run = read(tmp_path / "bag")
    assert set(run.regime.values) == {"COASTING", "ADHESION_LIMITED"}
    assert run.counts == {"regime": "ADHESION_LIMITED"}


def told(name: str, second: int) -> bytes:
    values = [KeyValue(key="regime", value="BRAKE_LIMITED"), KeyValue(key="resets", value="1")]
    status = [DiagnosticStatus(name=name, values=values)]
    return bytes(serialize_message(DiagnosticArray(header=messages.header(START_NS + second * S), status=status)))


def test_the_series_are_those_of_the_recording(recorded: Run) -> None:
    times = [START_NS + second * S for second in range(20)]
    for series, value in ((recorded.true_mu, 0.1), (recorded.mu, 0.09), (recorded.mu_lower, 0.08)):
        assert series.t_ns.tolist() == times
        assert set(series.values.tolist()) == {value}
    for speeds in (recorded.speed, recorded.true_speed):
        assert speeds.values.tolist() == [80.0 - 2.0 * second for second in range(20)]
    assert recorded.true_position.values.tolist() == [80.0 * second - second**2 for second in range(20)]
    assert set(recorded.pressure.values.tolist()) == {410e3}  # gauge
    assert recorded.regime.values.tolist() == ["COASTING"] * 5 + ["ADHESION_LIMITED"] * 15


def record_with_losses(path: Path, *lost: tuple[Topic, int]) -> Path:
    """Record 20 estimates, mu rising by 0.001 each second, as a live node logs them: 0.3 s after their stamps."""
    with BagWriter(path) as writer:
        for second in range(20):
            t_ns, mu = START_NS + second * S, 0.08 + 0.001 * second
            published: tuple[tuple[Topic, Any], ...] = (
                (MU, Float64(data=mu)),
                (MU_LOWER, Float64(data=mu - 0.01)),
                (DECELERATION, messages.deceleration_message(t_ns, mu, 0.001)),
                (STATE, messages.state_message(t_ns, 80.0 * second, 1.0, 80.0, 1.0)),
            )
            for at, (topic, message) in enumerate(published):
                if (topic, second) not in lost:
                    log_ns = t_ns + 3 * S // 10 + at * S // 1000
                    writer.write(f"/{topic.name}", topic.type, serialize_message(message), log_ns)
    return path


@pytest.mark.parametrize(
    "lost",
    [
        ((MU, 7),),
        ((MU_LOWER, 7),),
        ((MU, 7), (STATE, 12)),  # as many of either: by their count they would pair
        ((MU_LOWER, 7), (STATE, 12)),
        ((MU_LOWER, 7), (STATE, 12), (DECELERATION, 12)),
        ((MU, 7), (MU, 8), *((DECELERATION, second) for second in range(20))),  # recorded without the stamped form
    ],
)
def test_a_lost_message_moves_no_other_one(lost: tuple[tuple[Topic, int], ...], tmp_path: Path) -> None:
    run = read(record_with_losses(tmp_path / "bag", *lost))
    rising = {START_NS + second * S: 0.08 + 0.001 * second for second in range(20)}
    for series, less, most_missing in ((run.mu, 0.0, 2), (run.mu_lower, 0.01, 2)):
        assert series.t_ns.size >= 20 - most_missing
        assert series.values == pytest.approx([rising[t_ns] - less for t_ns in series.t_ns.tolist()], abs=1e-12)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What waits is bounded: however much comes, and however long something is silent."""

from __future__ import annotations

from typing import Any

import pytest
from test_inbox import CREEP, Feeder, S, position, running

from adhesion_node.core import (
    Config,
    ForceSample,
    PositionSample,
    PressureSample,
    SpeedSample,
    WheelSample,
)
from adhesion_node.core.estimator import gate_of
from adhesion_node.core.intake.inbox import settle
from adhesion_node.core.intake.outcome import Outcome
from adhesion_node.core.intake.stream import MOST


def test_what_waits_has_a_bound() -> None:
    feeder = Feeder(gate_of(Config(max_lag_s=60.0)))
    feeder.push(position(100.0))
    for number in range(MOST + 5):
        feeder.push(PositionSample(100 * S - 1 - number, 0.0, 1.0))
    assert len(feeder.inbox.anchors.samples) == MOST
    assert len(feeder.matched) + len(feeder.outcomes) == 6


@pytest.mark.parametrize("kind", [SpeedSample, ForceSample])
def test_one_stream_alone_has_a_bound(kind: type[Any]) -> None:
    feeder = Feeder(CREEP)
    for number in range(20_000):
        feeder.push(kind(number * S // 100, 1.0))
    (stream,) = feeder.inbox.others.values()
    assert len(stream.samples) <= MOST


def test_streams_stay_short_while_anchors_come() -> None:
    feeder = Feeder(CREEP)
    for number in range(5000):
        t_ns = number * S // 100
        feeder.push(SpeedSample(t_ns, 1.0), ForceSample(t_ns, 1.0), WheelSample(t_ns, (1.0,)))
    assert all(len(stream.samples) < 500 for stream in feeder.inbox.others.values())


def test_a_flood_is_thinned_to_200_a_second() -> None:
    feeder = Feeder()
    feeder.push(*(PressureSample(number * S // 10_000, 1.0) for number in range(10_000)))
    assert feeder.outcomes.count(Outcome.TOO_OFTEN) == 10_000 - len(feeder.inbox.stream(PressureSample).samples)
    assert 200 <= len(feeder.inbox.stream(PressureSample).samples) <= 211


def test_silence_ends_every_wait_but_that_of_a_stray_stamp() -> None:
    feeder = running()
    feeder.push(position(1.1), position(31.0))
    settled = settle(feeder.gate, feeder.inbox)
    assert [each.anchor for each in settled.matched] == [position(1.1)]
    assert settled.inbox.suspects == (position(31.0),)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Memory stays flat: half an hour of 10 Hz through the pipeline, with every fault that could make something pile up."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterable, Iterator
from itertools import chain, islice
from types import BuiltinFunctionType, FunctionType, ModuleType
from typing import Any

import messages
import numpy as np
import pytest

from adhesion_node.bench.scene import journey
from adhesion_node.core import Config
from adhesion_node.core.intake import stream
from adhesion_node.core.intake.samples import PositionSample, PressureSample, Sample, SpeedSample, WheelSample
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION

S = 10**9
TURN = 1350
"""Ticks under each fault: 2 minutes, several times brake, release and acceleration."""

PARTS = 3
"""Of a turn: what grows is greater in the last one than in the first."""

MOST = 250
"""In the place of the bounds for 60 s of 100 Hz: reached soon."""

CONFIG = Config(window=30, step=20, max_lag_s=0.5)

EVERY = 50
"""Ticks between two looks at what is held."""

SHARED = (type, ModuleType, FunctionType, BuiltinFunctionType, Config)
"""Belongs to no pipeline alone."""

MORE = 1.6
"""What is held goes up and down with the brake: hypotheses come and go."""

REASONS = ("BAD_VARIANCE", "DUPLICATE", "INVALID", "LATE", "NOT_FINITE", "OUTLIER", "STUCK", "TOO_OFTEN")

Pair = tuple[PressureSample, PositionSample]
Sent = Sample | Any
"""A sample, or a message that is still to be read."""
Fault = Callable[[Iterator[Pair]], Iterator[tuple[Sent, ...]]]


def none(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    yield from pairs


def flood(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    """10 kHz of every sensor for a tick in 150, with stamps to match."""
    for number, (pressure, position) in enumerate(pairs):
        for after in range(1000 if number % 150 == 0 else 1):
            t_ns = pressure.t_ns + after * S // 10_000
            yield pressure._replace(t_ns=t_ns), position._replace(t_ns=t_ns), SpeedSample(t_ns, 80.0)


def unusable(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    for pressure, position in pairs:
        t_ns = pressure.t_ns
        bad = position._replace(t_ns=t_ns + S // 20, variance_m2=-1.0)
        yield messages.position(t_ns, np.nan, 0.5), messages.position(t_ns, 1.0, 1e5), pressure, position, bad
        yield (messages.brake_pressure(t_ns, np.inf, 0.0),)


def duplicates(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    for pair in pairs:
        yield pair * 2


def late(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    """Each second one after the next one: within the lag."""
    for first, second in zip(pairs, pairs, strict=False):
        yield second + first


def too_late(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    """Every tick brings a message of 2 s ago as well."""
    for pressure, position in pairs:
        yield pressure, position, position._replace(t_ns=position.t_ns - 2 * S)


def outliers(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    """Without end, and never twice at the same place."""
    for number, (pressure, position) in enumerate(pairs):
        yield pressure, position._replace(position_m=position.position_m + 5e3 * (-1) ** number)


def pressure_alone(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    for pressure, _ in pairs:
        yield pressure, SpeedSample(pressure.t_ns, 80.0), WheelSample(pressure.t_ns, (170.0, 171.0))


def position_alone(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    for _, position in pairs:
        yield (position,)


def stuck(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    for pressure, position in pairs:
        yield pressure, position._replace(position_m=1.0)


def looped(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    """20 s of it, again and again."""
    turn = list(islice(pairs, 200))
    yield from islice(chain.from_iterable(turn for _ in range(TURN)), TURN)


def standing(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    """One stamp again and again, and no pressure of that time."""
    start_ns = next(pairs)[0].t_ns
    for pressure, position in pairs:
        yield pressure._replace(t_ns=start_ns), position._replace(t_ns=start_ns + S // 2)


def around(pairs: Iterator[Pair]) -> Iterator[tuple[Sent, ...]]:
    """The sensors' clock stands; their stamps scatter about it, all different."""
    rng, start_ns = np.random.default_rng(1), next(pairs)[0].t_ns
    for pressure, position in pairs:
        t_ns = start_ns + round(rng.uniform(-0.2, 0.2) * S)
        yield pressure._replace(t_ns=t_ns), position._replace(t_ns=t_ns)


FAULTS: tuple[Fault, ...] = (
    *(none, flood, unusable, duplicates, late, too_late, outliers, pressure_alone, position_alone, stuck, looped),
    *(standing, around),
)


def take(pipeline: Pipeline, sent: Sent) -> None:
    """As an offline replay does."""
    if isinstance(sent, (PressureSample, PositionSample, SpeedSample, WheelSample)):
        pipeline.push(sent)
        return
    topic = POSITION if hasattr(sent, "pose") else BRAKE_PRESSURE
    try:
        topic.read(sent)
    except Rejected as refusal:
        pipeline.refuse(topic.name, refusal.reason)


def held(pipeline: Pipeline) -> int:
    """Size of all that can be reached from the pipeline, bytes."""
    seen, size = set[int](), 0
    waiting: list[Any] = [vars(pipeline)]
    while waiting:
        one = waiting.pop()
        if id(one) not in seen and not isinstance(one, SHARED):
            seen.add(id(one))
            size += sys.getsizeof(one)
            waiting += [one.base] if isinstance(one, np.ndarray) else gc.get_referents(one)
    return size


def peaks(pipeline: Pipeline, stream: Iterable[tuple[Sent, ...]]) -> list[int]:
    """The most that is held in each part of a stream."""
    sizes = []
    for number, sent in enumerate(stream):
        for one in sent:
            take(pipeline, one)
        if number % EVERY == 0:
            sizes.append(held(pipeline))
    return [int(max(part)) for part in np.array_split(sizes, PARTS)]


def test_half_an_hour_of_faults_leaves_no_more_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "MOST", MOST)
    pipeline = Pipeline(CONFIG, 1)
    pairs = journey(10.0, np.random.default_rng(1))
    most = {fault.__name__: peaks(pipeline, fault(islice(pairs, TURN))) for fault in FAULTS}
    afterwards = peaks(pipeline, none(islice(pairs, TURN)))
    assert {name: parts for name, parts in most.items() if max(parts) > MORE * parts[0]} == {}
    # what is left of a fault goes as soon as two stamps agree on the new time
    assert max(afterwards[1:]) <= MORE * most["none"][0]
    assert pipeline.windows > 250
    assert all(pipeline.dropped[reason] > TURN // 3 for reason in REASONS), pipeline.dropped

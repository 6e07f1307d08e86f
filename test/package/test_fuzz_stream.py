# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whatever the sensors send, the pipeline stands: arbitrary streams of good and bad samples.

Hypothesis draws what follows what: pieces of a real braking, garbage, duplicates, late ones, jumps of the clock.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

from hypothesis import example, given
from hypothesis import strategies as st
from oracles import ride
from watched import CONFIGS, NUMBERS, START_NS, S, Watched

from adhesion_node.core import Config, Measurement
from adhesion_node.core.intake.samples import PositionSample, PressureSample, Sample, SpeedSample
from adhesion_node.wire.line import MAX_ABSOLUTE_PA

GOOD = ride([(3.0, 0.0), (9.0, 410e3), (1.0, 0.0), (3.0, 200e3)])
PRESSURES_PA = st.sampled_from([math.nan, math.inf, 0.0, 1e-300, MAX_ABSOLUTE_PA]) | st.floats(0.0, MAX_ABSOLUTE_PA)
OFFSETS_NS = st.sampled_from([0, 1, -1, S // 20, -S // 20, S, -S, 5 * S, -5 * S, 59 * S, 100 * S, -100 * S, 3600 * S])
"""Of a stray sample against the good ones around it."""
JUMPS_NS = st.sampled_from([0, 1, -S, S, 3 * S, -30 * S, 30 * S, -100 * S, 100 * S, 3600 * S, 10**18])


def strays() -> st.SearchStrategy[tuple[Any, ...]]:
    """A sample at an offset from the good ones."""
    return st.one_of(
        st.tuples(st.just(PositionSample), OFFSETS_NS, NUMBERS, NUMBERS),
        st.tuples(st.just(PressureSample), OFFSETS_NS, PRESSURES_PA),
        st.tuples(st.just(SpeedSample), OFFSETS_NS, NUMBERS),
    )


PIECES = st.one_of(
    st.tuples(st.just("good"), st.integers(1, 60)),
    st.tuples(st.just("backwards"), st.integers(2, 10)),
    st.tuples(st.just("without pressure"), st.integers(1, 30)),
    st.tuples(st.just("speed"), st.integers(1, 20)),
    st.tuples(st.just("again"), st.integers(1, 5)),
    st.tuples(st.just("elsewhere"), st.integers(1, 15)),
    st.tuples(st.just("jump"), JUMPS_NS),
    st.tuples(st.just("stray"), strays()),
)


def samples_of(pieces: Iterable[tuple[str, Any]]) -> Iterator[Sample]:
    """Yield the samples of a stream: the good run goes on from piece to piece, and around."""
    place, origin_ns = 0, START_NS
    for kind, value in pieces:
        if kind == "jump":
            origin_ns += value
            continue
        if kind == "stray":
            sample, offset_ns, *numbers = value
            yield sample(origin_ns + GOOD[place % len(GOOD)].t_ns + offset_ns, *numbers)
            continue
        piece = [shifted(number, origin_ns) for number in range(place, place + value)]
        place += 0 if kind == "again" else value
        for good in reversed(piece) if kind == "backwards" else piece:
            if kind not in ("without pressure", "again"):
                yield PressureSample(good.t_ns, good.brake_pressure_pa or 0.0)
            if kind == "speed":
                yield SpeedSample(good.t_ns, 70.0)
            yield PositionSample(good.t_ns, good.position_m + 5000.0 * (kind == "elsewhere"), good.variance_m2)


def shifted(number: int, origin_ns: int) -> Measurement:
    """Return a measurement of the good run, which begins anew at its end."""
    rounds, index = divmod(number, len(GOOD))
    return GOOD[index]._replace(t_ns=origin_ns + rounds * (GOOD[-1].t_ns + S // 10) + GOOD[index].t_ns)


@given(config=CONFIGS, pieces=st.lists(PIECES, max_size=12))
@example(config=Config(), pieces=[("again", 1), ("jump", 1), ("good", 1)])  # a position that is said twice
def test_any_stream_of_samples(config: Config, pieces: list[tuple[str, Any]]) -> None:
    watched = Watched(config)
    for sample in samples_of(pieces):
        watched.push(sample)
    watched.finish()

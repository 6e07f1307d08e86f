# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The gate for time under whatever may come: nothing lost or doubled, no order of arrival seen, nothing unbounded."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping

from hypothesis import given, settings
from hypothesis import strategies as st

from adhesion_node.core import (
    Config,
    DemandSample,
    ImuSample,
    PositionSample,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from adhesion_node.core.estimator import gate_of
from adhesion_node.core.intake.inbox import Pushed, drain, push, settle
from adhesion_node.core.intake.outcome import Outcome
from adhesion_node.core.intake.pairing import Gate, Inbox, Matched, Tick

MS = 1_000_000
KINDS: tuple[Callable[[int], Sample], ...] = (
    lambda ms: PositionSample(ms * MS, 0.0, 1.0),
    lambda ms: PressureSample(ms * MS, float(ms)),
    lambda ms: SpeedSample(ms * MS, 10.0),
    lambda ms: WheelSample(ms * MS, (20.0,)),
    lambda ms: ImuSample(ms * MS, -0.1),
    lambda ms: DemandSample(ms * MS, float(ms)),
)
RESETS = {Outcome.RESET}
WAIT_MS = round(Config().pressure_wait_s * 1000)
LAG_MS = 500

STAMPS = st.one_of(
    st.integers(-5_000, 20_000), st.integers(-100_000, 100_000), st.sampled_from((0, 4_000_000, -4_000_000))
)
ARRIVALS = st.lists(st.tuples(st.integers(0, len(KINDS)), STAMPS), max_size=60)
"""Sensor and stamp, ms; one number beyond the sensors is silence."""


@st.composite
def sensors(draw: st.DrawFn) -> list[list[int]]:
    """Stamps, ms, of each sensor: one period, a jitter, gaps; some sensor falls silent or begins late."""
    gaps = draw(st.lists(st.tuples(st.integers(0, 6_000), st.integers(100, 6_000)), max_size=2))
    streams = []
    for _ in KINDS:
        period = draw(st.sampled_from((20, 50, 100, 200, 1_000)))
        first, last = draw(st.integers(0, 3_000)), draw(st.sampled_from((2_000, 5_000, 8_000)))
        jitter = draw(st.lists(st.integers(0, period // 2), min_size=1, max_size=7))
        stamps = [ms + jitter[index % len(jitter)] for index, ms in enumerate(range(first, last, period))]
        streams.append([ms for ms in stamps if not any(gap < ms < gap + long for gap, long in gaps)])
    return streams


def passed(gate: Gate, samples: list[Sample | None]) -> tuple[list[Matched], Counter[Outcome], Inbox]:
    """All that is released and what became of the rest; None is silence."""
    inbox, matched, counts = Inbox(), list[Matched](), Counter[Outcome]()

    def keep(pushed: Pushed) -> Inbox:
        matched.extend((*pushed.ended, *pushed.matched))
        counts.update(event.outcome for event in pushed.events)
        assert len({type(suspect) for suspect in pushed.inbox.suspects}) == len(pushed.inbox.suspects)
        return pushed.inbox

    for sample in samples:
        inbox = keep(settle(gate, inbox) if sample is None else push(gate, inbox, sample))
    return matched, counts, keep(drain(gate, inbox))


def arrived(streams: list[list[int]], delays: Mapping[int, int], late: list[int]) -> list[Sample | None]:
    """The samples in the order of arrival: each sensor delayed by its own time, positions by further ones."""
    arriving = [
        (ms + delays[kind] + (late[index % len(late)] if kind == 0 else 0), delays[kind], kind, ms)
        for kind, stamps in enumerate(streams)
        for index, ms in enumerate(stamps)
    ]
    return [KINDS[kind](ms) for *_, kind, ms in sorted(arriving)]


@settings(deadline=None, max_examples=100)
@given(ARRIVALS, st.sampled_from((0.0, 0.2, 60.0)), st.sampled_from((0.0, 0.2)), st.integers(1, 20))
def test_every_position_is_released_or_counted_once(
    arrivals: list[tuple[int, int]], lag_s: float, wait_s: float, late_run: int
) -> None:
    gate = gate_of(Config(max_lag_s=lag_s, pressure_wait_s=wait_s, max_outliers=late_run))
    only = [(kind, ms) for kind, ms in arrivals if kind in (0, len(KINDS))]
    for these in (only, arrivals):
        samples = [KINDS[kind](ms) if kind < len(KINDS) else None for kind, ms in these]
        matched, counts, inbox = passed(gate, samples)
        positions = Counter(sample.t_ns for sample in samples if isinstance(sample, PositionSample))
        released = Counter(each.anchor.t_ns for each in matched if not isinstance(each.anchor, Tick))
        dropped = counts.total() - counts[Outcome.RESET]
        assert released <= positions
        assert positions.total() - released.total() <= dropped
        assert these is not only or positions.total() - released.total() == dropped
        assert not inbox.anchors.samples
        assert RESETS & set(counts) or [each.anchor.t_ns for each in matched] == sorted(
            {each.anchor.t_ns for each in matched}
        )
        for anchor, values in matched:
            for value, source in zip(values, gate.sources, strict=True):
                assert source.each or value is None or 0 <= anchor.t_ns - value.t_ns <= source.age_ns
                assert not source.each or all(sample.t_ns <= anchor.t_ns for sample in value)
                assert not source.each or list(value) == sorted(set(value))


@settings(deadline=None, max_examples=60)
@given(
    sensors(),
    st.lists(st.integers(0, WAIT_MS - 1), min_size=len(KINDS), max_size=len(KINDS)),
    st.lists(st.integers(0, LAG_MS - 1)),
)
def test_no_order_of_arrival_is_seen(streams: list[list[int]], delays: list[int], late: list[int]) -> None:
    """Each sensor is delayed by less than the wait; with max_lag_s positions come in any order within it."""
    for lag_ms, further in ((0, [0]), (LAG_MS, late or [0])):
        gate = gate_of(Config(max_lag_s=lag_ms / 1000))
        own = delays if lag_ms == 0 else [0, *delays[1:]]
        prompt = passed(gate, arrived(streams, dict.fromkeys(range(len(KINDS)), 0), [0]))[:2]
        assert passed(gate, arrived(streams, dict(enumerate(own)), further))[:2] == prompt

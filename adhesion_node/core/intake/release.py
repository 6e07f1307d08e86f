# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""When an anchor is released, or a tick where anchors fail to come: by stamps only, whatever the order of arrival.

An anchor waits until every other sensor that is there has come as far as its stamp, at most `wait_ns` by the anchors'
own stamps, and until late anchors could have come. A tick stands `tick_ns` after what was released before, or a
multiple of that where nothing has been measured in between. It waits until neither an anchor nor another sample of
its time can be expected: as long as they were late so far, and never less than an anchor would wait for them. The very
first one waits for the first anchor, which a network may hold back.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import MappingProxyType
from typing import Any

from .pairing import (
    PRESENT_NS,
    Gate,
    Inbox,
    Matched,
    Source,
    Tick,
    each_of,
    is_present,
    longest_wait_ns,
    missing_of,
    value_of,
    waits_of,
)
from .samples import Measurement

NEAR_TICK = 5
"""An anchor within this part of `tick_ns` behind a tick takes its place: sensors jitter."""


def release(gate: Gate, inbox: Inbox, count: int, until_ns: int | None = None) -> tuple[Inbox, tuple[Matched, ...]]:
    """Release the first `count` anchors and all that need not wait any longer, each with the samples of its time.

    Up to `until_ns` no tick waits.
    """
    left = len(inbox.anchors.samples) - count
    matched: list[Matched] = []
    while (turn := _turn(gate, inbox, len(inbox.anchors.samples) > left, until_ns)) is not None:
        inbox, values = _given_out(gate, inbox, turn)
        matched.append(Matched(turn, values))
    return inbox, tuple(matched)


def _turn(gate: Gate, inbox: Inbox, forced: bool, until_ns: int | None) -> Any | None:
    """The anchor or tick that may be released next, in order; None: wait."""
    tick_ns, waiting = _next_tick_ns(gate, inbox), inbox.anchors.samples
    near_ns = gate.tick_ns // NEAR_TICK
    if tick_ns is not None and not (waiting and waiting[0].t_ns <= tick_ns + near_ns):
        due = until_ns is not None and tick_ns <= until_ns
        return Tick(tick_ns) if due or (forced and waiting) or _is_due(gate, inbox, tick_ns, near_ns) else None
    if not waiting or forced:
        return waiting[0] if waiting else None
    anchor = waiting[0]
    ready = _is_ready(gate, inbox, anchor, near_ns) or (gate.tick_ns and _is_past(gate, inbox, anchor.t_ns))
    return anchor if ready else None


def _is_ready(gate: Gate, inbox: Inbox, anchor: Any, near_ns: int) -> bool:
    """Whether the first anchor that waits has all that is to be expected of its time."""
    if not _is_last(gate, inbox, anchor.t_ns):
        return False
    if isinstance(anchor, Measurement):  # complete as it is
        return True
    # before it, a tick may still come to be
    before_ns, ticks = inbox.released_ns, 0
    if gate.tick_ns and before_ns is not None:
        ticks = (anchor.t_ns - near_ns - 1 - before_ns) // gate.tick_ns
    may_tick = ticks > 0 and before_ns is not None and _lacks(gate, inbox, before_ns + ticks * gate.tick_ns)
    return not (may_tick or _lacks(gate, _at_turn(gate, inbox, anchor.t_ns), anchor.t_ns))


def _given_out(gate: Gate, inbox: Inbox, turn: Any) -> tuple[Inbox, tuple[Any, ...]]:
    """The samples of the time of an anchor or tick, which waits no longer; those that come once are used up."""
    t_ns, others, is_complete = turn.t_ns, inbox.others, isinstance(turn, Measurement)
    inbox = _at_turn(gate, inbox, t_ns)
    values, waits = [] if is_complete else [*missing_of(gate)], waits_of(gate)
    for kind, stream in () if is_complete else inbox.others.items():
        for wait_ns, sources in waits.get(kind, {}).items():
            # what was not waited for must have been there before
            known_ns = t_ns if is_present(inbox, wait_ns, stream, t_ns) else t_ns - wait_ns
            for place, source in sources:
                if not source.each:
                    values[place] = value_of(source, stream, t_ns, known_ns)
                elif each := each_of(inbox, source, stream, t_ns, known_ns):
                    values[place] = each
                    others = MappingProxyType(others | {kind: stream.spent(each[-1].t_ns)})
    if isinstance(turn, Tick):
        return inbox._replace(released_ns=t_ns, others=others), tuple(values)
    anchors = inbox.anchors.after_first()
    return inbox._replace(released_ns=t_ns, anchored_ns=t_ns, anchors=anchors, others=others), tuple(values)


def _at_turn(gate: Gate, inbox: Inbox, t_ns: int) -> Inbox:
    """The inbox as it is once a time is released, which may be the first, of all or after a gap."""
    begins = inbox.released_ns is None or t_ns > inbox.released_ns + gate.far_ns
    return inbox._replace(begun_ns=t_ns) if begins else inbox


def _is_last(gate: Gate, inbox: Inbox, t_ns: int) -> bool:
    """Whether by the anchors' own stamps no earlier one can come than a time."""
    newest_ns = inbox.anchors.newest_ns
    return newest_ns is not None and t_ns <= newest_ns - gate.max_lag_ns


def _lacks(gate: Gate, inbox: Inbox, t_ns: int) -> bool:
    """Whether a sensor that is there has not come as far as a time, and is to be waited for by the anchors' stamps."""
    newest_ns, begun_ns, others = inbox.anchors.newest_ns, inbox.begun_ns, inbox.others
    for source in gate.sources:  # at every anchor: quicker than `any`
        if newest_ns is None or t_ns > newest_ns - source.wait_ns:
            stream = others.get(source.kind)
            if stream is None and t_ns > begun_ns + source.wait_ns:  # nor is it there
                continue
            if (stream is None or not stream.has_reached(t_ns)) and is_present(inbox, source.wait_ns, stream, t_ns):
                return True
    return False


def _next_tick_ns(gate: Gate, inbox: Inbox) -> int | None:
    """When the other sensors have something new to tell next, if no anchor comes before; None: at no time so far."""
    before_ns = inbox.released_ns
    if before_ns is not None and inbox.now_ns is not None and inbox.now_ns < before_ns + gate.tick_ns:
        return None
    leading = [source for source in gate.sources if source.leads]
    streams = [inbox.stream(source.kind) for source in leading]
    if before_ns is None:
        before_ns = min((stream.samples[0].t_ns for stream in streams if stream.samples), default=None)
    if not gate.tick_ns or before_ns is None or inbox.now_ns is None or inbox.now_ns < before_ns + gate.tick_ns:
        return None
    led = (inbox.anchored_ns, *(stream.spent_ns for stream in streams))
    led_ns = max((t_ns for t_ns in led if t_ns is not None), default=before_ns)
    first_ns = _earliest(gate, inbox, gate.sources, before_ns)
    if first_ns is None or first_ns <= led_ns + gate.tick_for_ns:
        return first_ns
    return _earliest(gate, inbox, leading, before_ns)


def _earliest(gate: Gate, inbox: Inbox, sources: Iterable[Source], before_ns: int) -> int | None:
    """The first tick at which one of the sensors has told something since what was released before."""
    ticks = []
    for source in sources:
        stream = inbox.stream(source.kind)
        new_ns = stream.next_ns(before_ns)
        if new_ns is not None:
            t_ns = before_ns - (before_ns - new_ns) // gate.tick_ns * gate.tick_ns
            if not is_present(inbox, source.wait_ns, stream, t_ns):
                t_ns = before_ns - (before_ns - new_ns - source.wait_ns) // gate.tick_ns * gate.tick_ns
            ticks.append(t_ns)
    return min(ticks, default=None)


def _is_due(gate: Gate, inbox: Inbox, tick_ns: int, near_ns: int) -> bool:
    """Whether no anchor can be expected that would take a tick's place, nor a sample of its time."""
    if _is_last(gate, inbox, tick_ns + near_ns) and not _lacks(gate, _at_turn(gate, inbox, tick_ns), tick_ns):
        return True
    return _is_past(gate, inbox, tick_ns + near_ns)


def _is_past(gate: Gate, inbox: Inbox, t_ns: int) -> bool:
    """Whether by the stamps of all sensors nothing more can be expected of a time: as late as any of them has been."""
    late = (stream.lag_ns for stream in inbox.others.values() if stream.lag_ns <= gate.far_ns)
    unheard_ns = PRESENT_NS if inbox.released_ns is None and inbox.anchors.newest_ns is None else 0
    wait_ns = max(longest_wait_ns(gate), unheard_ns, inbox.anchors.lag_ns, *late)
    return inbox.now_ns is not None and inbox.now_ns >= t_ns + wait_ns

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The one gate for time: puts the samples of all sensors in order, pairs them, tells when time has jumped.

One sensor is the anchor: its samples are released in order, each with what the others measured at its time
(`pairing`). A stamp far from all others is set aside until a second one agrees with it: a single wrong stamp stops
nothing. A sensor in order clears only what it has set aside itself, and no time begins anew without an anchor: the
wrong clock of another sensor stops nothing either. Only stamps decide, never a clock: a live node and an offline replay
pair alike.
"""

from collections.abc import Iterable, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from .outcome import Event, Outcome
from .pairing import Gate, Inbox, Matched, S, kept_ns, longest_wait_ns
from .release import release
from .samples import Measurement, Sample


class Pushed(NamedTuple):
    """Result of a push."""

    inbox: Inbox
    matched: tuple[Matched, ...] = ()
    events: tuple[Event, ...] = ()
    """What became of samples other than that they were taken in; RESET where time has jumped."""
    ended: tuple[Matched, ...] = ()
    """With RESET: what still waited of the time before."""


def push(gate: Gate, inbox: Inbox, sample: Sample) -> Pushed:
    """Take one sample; return what is complete now."""
    t_ns, now_ns, suspects = sample.t_ns, inbox.now_ns, inbox.suspects
    believed = now_ns is None or now_ns - gate.reset_ns <= t_ns <= now_ns + gate.far_ns
    if believed and not suspects:
        return _take(gate, inbox, sample)
    if now_ns is None or believed:
        return _believed(gate, inbox, sample)
    of_kind = tuple(each for each in suspects if type(each) is type(sample))
    of_others = tuple(each for each in suspects if type(each) is not type(sample))
    if any(each.t_ns == t_ns for each in of_kind):
        return Pushed(inbox, events=(_doubled(sample),))
    near_ns = min(abs(t_ns - now_ns), gate.reset_ns)
    agreeing = [each for each in suspects if abs(each.t_ns - t_ns) < near_ns]
    together = sorted((*agreeing, sample), key=lambda each: each.t_ns)
    is_gap = now_ns <= together[0].t_ns and together[-1].t_ns <= now_ns + gate.reset_ns
    anchors = [each for each in together if isinstance(each, gate.anchor | Measurement)]
    if agreeing and (is_gap or (anchors and not _returns(gate, inbox, t_ns))):
        left = tuple(each for each in suspects if each not in agreeing)
        return _jump(gate, inbox._replace(suspects=left), is_gap, together)
    count, before_ns = inbox.late
    late = (count + isinstance(sample, gate.anchor | Measurement), before_ns)
    return Pushed(inbox._replace(suspects=(*of_others, sample), late=late), events=_strays(now_ns, of_kind))


def drain(gate: Gate, inbox: Inbox) -> Pushed:
    """End of the data: all that waits, with what is known so far; what is set aside was stray."""
    strays = _strays(inbox.now_ns, inbox.suspects)
    inbox = inbox._replace(suspects=())
    return _with(strays, Pushed(*release(gate, inbox, len(inbox.anchors.samples), inbox.now_ns)))


def settle(gate: Gate, inbox: Inbox) -> Pushed:
    """End of the waits in silence: all anchors that wait, with what is known so far."""
    return Pushed(*release(gate, inbox, len(inbox.anchors.samples)))


def _believed(gate: Gate, inbox: Inbox, sample: Any) -> Pushed:
    """Let a sample in, and behind it what was set aside only because it came first, as none came earlier."""
    until_ns = sample.t_ns + longest_wait_ns(gate)
    behind = [each for each in inbox.suspects if sample.t_ns <= each.t_ns < until_ns]
    apart = [each for each in inbox.suspects if each not in behind]
    of_kind = [each for each in apart if type(each) is type(sample)]
    inbox = inbox._replace(suspects=tuple(each for each in apart if each not in of_kind))
    strays = _strays(inbox.now_ns, of_kind)
    return _with(strays, _take_all(gate, _take(gate, inbox, sample), sorted(behind, key=lambda each: each.t_ns)))


def _take(gate: Gate, inbox: Inbox, sample: Any) -> Pushed:
    """Let a sample in whose stamp is believed."""
    if isinstance(sample, (gate.anchor, Measurement)):  # at every sample: quicker than to unite the types
        return _take_anchor(gate, inbox, sample)
    stream = inbox.stream(type(sample))
    refused = stream.refusal(sample.t_ns)
    if refused is not None:
        of_others = Outcome.REPEATED if refused is Outcome.DUPLICATE else refused
        return Pushed(inbox, events=(Event(of_others, _named(sample)),))
    overtaken: tuple[Event, ...] = ()
    first_ns, now_ns, released_ns = None, _newest(inbox.now_ns, sample), inbox.released_ns
    if released_ns is not None:
        if sample.t_ns <= released_ns and not inbox.late[0]:  # a time that begins anew may still need it
            overtaken = _overtaken(gate, inbox, sample, released_ns)
        if not stream.has_reached(sample.t_ns):  # what is out of order may belong to a time about to begin anew
            first_ns = released_ns - kept_ns(gate)
    stream = stream.delayed(now_ns - sample.t_ns).added(sample, first_ns)
    inbox = inbox.with_stream(type(sample), stream.after_first() if stream.excess else stream, now_ns)
    return _with(overtaken, Pushed(*release(gate, inbox, 0)))


def _overtaken(gate: Gate, inbox: Inbox, sample: Any, released_ns: int) -> tuple[Event, ...]:
    """What becomes of a sample that no anchor or tick behind the last released one can be given any more."""
    sources = [source for source in gate.sources if source.kind is type(sample)]
    if not sources or not all(source.each for source in sources):
        return ()
    spent_ns = inbox.stream(type(sample)).spent_ns
    spent = spent_ns is not None and sample.t_ns <= spent_ns
    too_old = sample.t_ns < released_ns - max(source.age_ns for source in sources)
    return (Event(Outcome.OVERTAKEN, _named(sample)),) if spent or too_old else ()


def _take_anchor(gate: Gate, inbox: Inbox, anchor: Any) -> Pushed:
    t_ns, newest_ns, released_ns = anchor.t_ns, inbox.anchors.newest_ns, inbox.released_ns
    if t_ns == inbox.anchored_ns:
        return Pushed(inbox, events=(_doubled(anchor),))
    now_ns = _newest(inbox.now_ns, anchor)
    behind_ns = now_ns - t_ns
    if newest_ns is not None:  # a single one among others has no tick wait as long: the next may show that all are late
        behind_ns = min(behind_ns, max(gate.far_ns, 2 * inbox.anchors.lag_ns))
    anchors = inbox.anchors.delayed(behind_ns)
    passed = released_ns is not None and t_ns <= released_ns
    if passed or (newest_ns is not None and t_ns < newest_ns - gate.max_lag_ns):
        return _late(gate, inbox._replace(anchors=anchors), anchor)
    refused = anchors.refusal(t_ns)
    if refused is not None:
        return Pushed(inbox._replace(anchors=anchors), events=(Event(refused, _named(anchor)),))
    inbox = inbox._replace(now_ns=now_ns, anchors=anchors.added(anchor), late=(0, 0))
    return Pushed(*release(gate, inbox, inbox.anchors.excess))


def _late(gate: Gate, inbox: Inbox, anchor: Any) -> Pushed:
    """Drop a late anchor; after enough of them in a row begin anew with the next that is after the one before."""
    count, before_ns = inbox.late
    count = count + 1
    if count >= gate.late_run and anchor.t_ns > before_ns:
        return _anew(gate, inbox, anchor)
    newest_ns = max(inbox.anchors.newest_ns or anchor.t_ns, inbox.released_ns or anchor.t_ns)
    event = Event(Outcome.LATE, f"{_named(anchor)}, {(newest_ns - anchor.t_ns) / S:g} s behind the newest")
    return Pushed(inbox._replace(late=(count, anchor.t_ns)), events=(event,))


def _returns(gate: Gate, inbox: Inbox, t_ns: int) -> bool:
    """Whether a stamp goes on with the time that was left: two clocks, unless no anchor has the new time any more."""
    if inbox.now_ns is None or inbox.left_ns is None or inbox.late[0] + 1 >= gate.late_run:
        return False
    return abs(t_ns - (inbox.now_ns + inbox.left_ns)) <= gate.reset_ns


def _jump(gate: Gate, inbox: Inbox, is_gap: bool, samples: Sequence[Any]) -> Pushed:
    """Stamps agree that time has jumped: a gap, or where it is long or back, another time."""
    first, *others = samples
    return _take_all(gate, _take(gate, inbox, first) if is_gap else _anew(gate, inbox, first), others)


def _take_all(gate: Gate, pushed: Pushed, samples: Iterable[Any]) -> Pushed:
    """Let further samples in, in the order of their stamps."""
    for sample in samples:
        inbox, matched, events, ended = _take(gate, pushed.inbox, sample)
        pushed = Pushed(inbox, pushed.matched + matched, pushed.events + events, pushed.ended + ended)
    return pushed


def _anew(gate: Gate, inbox: Inbox, sample: Any) -> Pushed:
    """Begin anew at the time of a sample, with what the other sensors have measured of it."""
    low, high = sample.t_ns - gate.reset_ns, sample.t_ns + gate.far_ns
    others = {kind: stream.between(low, high) for kind, stream in inbox.others.items()}
    newest = [stream.newest_ns for stream in others.values() if stream.newest_ns is not None]
    left_ns = None if inbox.now_ns is None else inbox.now_ns - sample.t_ns
    fresh = Inbox(max(newest, default=None), others=MappingProxyType(others), suspects=inbox.suspects, left_ns=left_ns)
    event = Event(Outcome.RESET, f"stamps went from {(inbox.now_ns or 0) / S:.12g} to {sample.t_ns / S:.12g} s")
    return _with((event,), _take(gate, fresh, sample))._replace(ended=settle(gate, inbox).matched)


def _newest(now_ns: int | None, sample: Any) -> int:
    return now_ns if now_ns is not None and now_ns > sample.t_ns else int(sample.t_ns)


def _named(sample: Any) -> str:
    return f"{type(sample).__name__} of {sample.t_ns / S:.12g} s"


def _doubled(sample: Any) -> Event:
    return Event(Outcome.DUPLICATE, _named(sample))


def _strays(now_ns: int | None, suspects: Iterable[Any]) -> tuple[Event, ...]:
    """What becomes of samples set aside with which none agrees."""
    apart_s = [(each, (each.t_ns - (now_ns or 0)) / S) for each in suspects]
    return tuple(Event(Outcome.STRAY, f"{_named(each)}, {apart:+g} s from all others") for each, apart in apart_s)


def _with(events: tuple[Event, ...], pushed: Pushed) -> Pushed:
    return pushed._replace(events=events + pushed.events) if events else pushed

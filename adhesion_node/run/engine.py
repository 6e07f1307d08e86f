# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What every pipeline does: step an estimator of the core, count what is dropped, digest what comes out."""

import hashlib
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from ..core import Event, Outcome, Sample
from ..core.intake.outcome import DROPS
from ..core.intake.pairing import Gate
from ..wire.topic import Topic

_USED = {outcome.name for outcome in Outcome} - {outcome.name for outcome in DROPS}


class _AnyState(Protocol):
    """What a pipeline needs to know of an estimator's state."""

    @property
    def gate(self) -> Gate: ...

    @property
    def counts(self) -> Mapping[Outcome, int]: ...

    @property
    def events(self) -> tuple[Event, ...]: ...


S = TypeVar("S", bound=_AnyState)
E = TypeVar("E")
Output = TypeVar("Output")


class Verbs(NamedTuple, Generic[S, E]):
    """An estimator of the core, its configuration at hand."""

    init: Callable[[], S]
    advance: Callable[[S, Sample], tuple[S, tuple[E, ...]]]
    settle: Callable[[S], tuple[S, tuple[E, ...]]]
    finish: Callable[[S], tuple[S, tuple[E, ...]]]


class EstimatorPipeline(ABC, Generic[S, E, Output]):
    """Steps an estimator; counts what is dropped and digests what comes out.

    Mutable: the one stateful thing around the pure core.
    """

    anchors: tuple[Topic, ...]
    """Their messages are the measurements; what the other sensors send belongs to them."""
    config: Any

    def __init__(self, verbs: Verbs[S, E]) -> None:
        self._verbs = verbs
        self.state = verbs.init()
        self.measurements = 0
        """Messages of the anchor received, whatever became of them."""
        self.last: E | None = None
        self.refused: dict[str, str] = {}
        """What was said of the first message that was refused, by reason."""
        self._before: Counter[str] = Counter()
        self._digest = hashlib.sha256()

    def push(self, sample: Sample) -> list[Output]:
        """Take one sample of any sensor and return what it completes."""
        self.measurements += isinstance(sample, self.state.gate.anchor)
        return self._published(*self._verbs.advance(self.state, sample))

    def settle(self) -> list[Output]:
        """Silence: use what waits for others of its time."""
        return self._published(*self._verbs.settle(self.state))

    def finish(self) -> list[Output]:
        """End of the data: use what still waits; call once."""
        return self._published(*self._verbs.finish(self.state))

    def reset(self) -> list[Output]:
        """End the data so far as `finish` does and start anew: only the counts and the digest go on."""
        outputs = self.finish()
        self._before = self._counts() + Counter({Outcome.RESET.name: 1})
        self.state = self._verbs.init()
        return outputs

    def adopt(self, other: "EstimatorPipeline[S, E, Output]") -> None:
        """Go on with what another one is configured with; what is known stays."""
        self._verbs, self.config = other._verbs, other.config

    def refuse(self, topic: str, reason: str, said: str = "") -> None:
        """Count a message of a topic that never became a sample, and keep what is said of the first one."""
        self.refused.setdefault(reason, f"{topic}: {said}" if said else "")
        self.measurements += any(topic == anchor.name for anchor in self.anchors)
        self._before[reason] += 1

    @property
    def events(self) -> tuple[Event, ...]:
        """What the sample that came last brought about, other than that it was used."""
        return self.state.events

    @property
    def resets(self) -> int:
        """How often it started anew."""
        return self._counts()[Outcome.RESET.name]

    @property
    def accepted(self) -> int:
        """Measurements that the estimator used."""
        return self._counts()[Outcome.ACCEPTED.name]

    @property
    def dropped(self) -> dict[str, int]:
        """Numbers of messages of any sensor that were not used, by reason; only reasons that occurred."""
        return {reason: count for reason, count in sorted(self._counts().items()) if reason not in _USED and count}

    @property
    def digest(self) -> str:
        """SHA-256 over every number published so far."""
        return self._digest.hexdigest()

    def _counts(self) -> Counter[str]:
        return self._before + Counter({outcome.name: count for outcome, count in self.state.counts.items()})

    def _published(self, state: S, estimates: tuple[E, ...]) -> list[Output]:
        self.state = state
        outputs = []
        for estimate in estimates:
            self.last = estimate
            output = self._output(estimate)
            self._digest.update(self._bytes(output))
            outputs.append(output)
        return outputs

    @property
    @abstractmethod
    def tally(self) -> str:
        """How much has come and what was made of it, in words."""

    @abstractmethod
    def stamp_ns(self, output: Output) -> int:
        """When it was so."""

    @abstractmethod
    def _output(self, estimate: E) -> Output:
        """What is published of an estimate."""

    @abstractmethod
    def _bytes(self, output: Output) -> bytes:
        """Every number of it, little-endian: integers as 8 bytes, floats as doubles."""

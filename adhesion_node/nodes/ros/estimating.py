# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""An estimator as a node: every message goes through its pipeline, as in an offline replay.

Stamps drive the work. The one timer watches for silence: it ends waits and speaks in /diagnostics, no more.
"""

from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Generic, NamedTuple, TypeVar

from std_srvs.srv import SetBool, Trigger

from adhesion_node.core import Event
from adhesion_node.core.atp.supervision import Severity
from adhesion_node.core.setting import Setting
from adhesion_node.run.engine import EstimatorPipeline
from adhesion_node.run.reader import Reader
from adhesion_node.wire import topics
from adhesion_node.wire.frames import placed
from adhesion_node.wire.line import Line
from adhesion_node.wire.messages.parts import NS
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.settings.setup import preset
from adhesion_node.wire.topic import Topic

from . import qos
from .diagnostics import Diagnostics, Finding, Told
from .listening.intake import Intake
from .managed import ManagedNode
from .params import current, declare
from .types import new

P = TypeVar("P", bound=EstimatorPipeline[Any, Any, Any])

NEWS_NS = 1_000_000_000
"""Time between two lines of the log about what has changed: a regime may waver."""

OFTEN, OFTEN_NS = 2, 60_000_000_000
"""So many resets within this time, by the node's clock, are a fault."""


class SetUp(NamedTuple, Generic[P]):
    """What the parameters make of a node."""

    pipeline: P
    line: Line
    sensor_timeout_s: float
    unread: Sequence[str] = ()
    """Parameters that the chosen method does not read, in words."""


class Kind(NamedTuple, Generic[P]):
    """What tells one estimator's node from another's."""

    name: str
    entry: str
    """Of /diagnostics, behind the node's name."""
    parameters: Sequence[Setting]
    set_up: Callable[[Mapping[str, Any]], SetUp[P]]
    inputs: Sequence[Topic]
    """The last one, or a position, must not fall silent."""
    results: Sequence[Topic]
    findings: Callable[[P], list[Finding]]
    """How the estimation stands, in words, and the numbers behind it."""
    values: Callable[[P], dict[str, str]]
    news: Callable[[P], tuple[Any, str]]
    """Of the newest estimate: what is logged when it changes, and the words for it."""


class EstimatingNode(ManagedNode, Generic[P]):
    """`heard` counts the messages received by topic, refused ones included; `published` those sent."""

    def __init__(self, kind: Kind[P], **kwargs: Any) -> None:
        super().__init__(kind.name, **kwargs)
        self._kind = kind
        values = declare(self, kind.parameters, preset, self._change)
        self.published: Counter[Topic] = Counter()
        told = partial(self.standing, self._told)
        self._diagnostics = Diagnostics(self, kind.entry, values, told, self.published)
        self.bring_up(values)

    def open(self) -> None:
        """Subscribe and advertise, with nothing known of train and rail."""
        self.pipeline, line, timeout_s, unread = self._kind.set_up(current(self, self._kind.parameters))
        for remark in unread:
            self.get_logger().warning(remark)
        self._resets: deque[int] = deque(maxlen=OFTEN)
        """When the latest ones were seen."""
        self._seen_resets = 0
        """Of the pipeline's: those in `_resets`, and those asked for by a service, which tell of no jump."""
        self._reader = Reader(self._kind.inputs, line)
        self._told_state: Any = None
        self._told_ns = -NEWS_NS
        self._intake = Intake(self, self, self._reader, timeout_s)
        hear = self._intake.tell
        self._outputs = {topic: qos.advertise(self, topic, tell=hear) for topic in self._kind.results}
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(SetBool, "~/set_enabled", self._on_set_enabled)

    def resume(self) -> None:
        """Go on where it was deactivated: a time without messages."""
        self._intake.resume()

    @property
    def heard(self) -> Counter[Topic]:
        """Messages received by topic."""
        return self._intake.heard

    @property
    def inputs(self) -> tuple[Topic, ...]:
        """What it subscribes to."""
        return self._reader.inputs

    @property
    def latest(self) -> Any:
        """The newest estimate, withheld or not."""
        return self.pipeline.last

    @property
    def digest(self) -> str:
        """SHA-256 over every number so far, the same as that of an offline replay."""
        return self.pipeline.digest

    def _change(self, values: Mapping[str, Any]) -> Callable[[], None]:
        """What is known of train and rail stays; an offline replay gives other numbers from here on."""
        pipeline, line, timeout_s, _ = self._kind.set_up(values)

        def put_in_force() -> None:
            if self.configured:
                self.pipeline.adopt(pipeline)
                self._intake.change(line, timeout_s)

        return put_in_force

    def close(self) -> None:
        """Use what still waits and publish what it gives."""
        if not self.configured:
            return
        self.publish(self.pipeline.finish())
        tally, dropped = self.pipeline.tally, self.pipeline.dropped or "none"
        self.get_logger().info(f"{tally}, dropped {dropped}, digest {self.digest}")

    def take(self, sample: Any) -> tuple[Sequence[Any], tuple[Event, ...]]:
        """Use a sample."""
        return self.pipeline.push(sample), self.pipeline.events

    def settle(self, silent_s: float) -> None:
        """Publish what has waited for others of its time; late ones may still come within the lag."""
        if silent_s * 1e9 >= self.pipeline.state.gate.max_lag_ns:
            self.publish(self.pipeline.settle())

    def refuse(self, topic: Topic, refusal: Rejected) -> None:
        """Count a refused message."""
        self.pipeline.refuse(topic.name, refusal.reason)

    def report(self) -> None:
        """Publish the state of affairs in /diagnostics."""
        self._diagnostics.tell()

    def _told(self) -> Told:
        """What is wrong, the worst of it said first, and the numbers; `stamp_ns` is that of the newest estimate."""
        found = [*self._intake.findings(), *self._kind.findings(self.pipeline), *self._often_reset()]
        for suspect in self.pipeline.state.inbox.suspects:
            text = f"{type(suspect).__name__} of {suspect.t_ns * 1e-9:.12g} s is set aside until a second stamp agrees"
            found.append(Finding(Severity.WARN, text))
        source = self._reader.source
        chosen = {"position_source": source.name} if source in topics.POSITIONS else {}
        stamp = {"stamp_ns": str(self.latest.t_ns) if self.latest is not None else "none"}
        unused = sorted(self._reader.line.unused)
        off = {"switched_off": ", ".join(unused)} if unused else {}
        lost = {f"lost.{topic.name}": str(count) for topic, count in self._intake.lost.items()}
        return found, stamp | self._kind.values(self.pipeline) | chosen | off | lost

    def _often_reset(self) -> list[Finding]:
        """Say when it starts anew again and again."""
        resets, now_ns = self.pipeline.resets, self.get_clock().now().nanoseconds
        self._resets.extend([now_ns] * min(resets - self._seen_resets, OFTEN))
        self._seen_resets = resets
        if len(self._resets) < OFTEN or any(abs(now_ns - t_ns) > OFTEN_NS for t_ns in self._resets):
            return []
        text = f"{resets} resets so far, {OFTEN} of them within {OFTEN_NS // NS} s: stamps or positions jump"
        return [Finding(Severity.WARN, f"{text}; does a recording loop, is there a second publisher?")]

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._begin_anew()
        self._reader.source = None
        return self._answered(response, "reset", "started anew")

    def _on_set_enabled(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if self._intake.enabled and not request.data:
            self._begin_anew()
        self._intake.enabled = request.data
        return self._answered(response, "set_enabled", "enabled" if request.data else "disabled: nothing is identified")

    def _begin_anew(self) -> None:
        """Start anew as asked, and publish what had waited."""
        outputs = self.pipeline.reset()
        self._seen_resets += 1
        self.publish(outputs)

    def _answered(self, response: Any, service: str, message: str) -> Any:
        response.success, response.message = True, message
        self.get_logger().info(f"~/{service}: {message}")
        self.report()
        return response

    def publish(self, outputs: Sequence[Any]) -> None:
        """Publish what was completed."""
        for output in outputs if self.active else ():
            for topic in self._kind.results:
                message = topic.build(new, output)
                if message is not None:
                    self._outputs[topic].publish(placed(message, self._reader.line))
                    self.published[topic] += 1
            self.report()
        if outputs:
            self._tell_news(self.pipeline.stamp_ns(outputs[-1]))

    def _tell_news(self, t_ns: int) -> None:
        """Log what has changed, but no more often than every `NEWS_NS`."""
        state, text = self._kind.news(self.pipeline)
        if state != self._told_state and abs(t_ns - self._told_ns) >= NEWS_NS:
            self._told_state, self._told_ns = state, t_ns
            self.get_logger().info(f"{t_ns * 1e-9:.1f} s: {text}")

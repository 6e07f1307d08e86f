# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The ATP monitor: supervises a target with the braking curve and says what has to be done.

::

    adhesion/state, adhesion/braking_curve, atp/target  ->  atp/status, /diagnostics

Every message, and every tick of two watchdogs, is a step of `core.atp.monitor`, which says what is judged when: silence
is no message, so one watchdog ticks by the ROS clock, and one by the machine's own for the case that the first stands.
"""

import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.atp.monitor import SILENCE, Event, Known, Now, Part, Refused, Rules, Tick, step
from adhesion_node.core.atp.received import NS_PER_S
from adhesion_node.core.atp.supervision import Decision, Level, Severity
from adhesion_node.core.physics.train import KMH
from adhesion_node.core.setting import make
from adhesion_node.wire import topics
from adhesion_node.wire.line import Line
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.settings.shared import ATP_SETTINGS, Watchdogs
from adhesion_node.wire.topic import Topic

from .ros import qos, runtime
from .ros.diagnostics import Diagnostics, Finding, Told, doubled, unlike
from .ros.managed import ManagedNode
from .ros.params import current, declare
from .ros.types import new

PARAMETERS = ATP_SETTINGS
INPUTS = (topics.STATE, topics.BRAKING_CURVE)
TARGET = ("target_position_m", "target_speed_kmh")

EXAMPLES = (
    "atp_monitor --ros-args -p target_position_m:=6000.0 -p target_speed_kmh:=100.0",
    "atp_monitor --ros-args -p target_position_m:=8200.0 -p target_speed_kmh:=0.0 -p use_sim_time:=true",
)

GRACE_S = 10.0
"""So long after the start silence is logged as waiting; the level is EMERGENCY_BRAKE from the first judgement on."""


class AtpMonitor(ManagedNode):
    """Supervises a target by the braking curve in the manner of ETCS, from NORMAL to EMERGENCY_BRAKE.

    Whatever is missing, old or not understood is an EMERGENCY_BRAKE. `heard` counts the messages received by topic,
    refused ones included; `published` those sent.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("atp_monitor", **kwargs)
        values = declare(self, PARAMETERS, change=self._change)
        self.heard: Counter[Topic] = Counter()
        self.published: Counter[Topic] = Counter()
        self._now_ns = self._stamp_ns = 0
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        told = partial(self.standing, self._told)
        self._diagnostics = Diagnostics(self, "supervision", values, told, self.published)
        self.bring_up(values)

    def open(self) -> None:
        """Subscribe and advertise."""
        values = current(self, PARAMETERS)
        watchdogs = make(Watchdogs, values)
        self._clock_timeout_s = watchdogs.clock_timeout_s
        self._line = make(Line, values)
        self._config = make(SupervisionConfig, values)
        self._forget()
        self._status = qos.advertise(self, topics.ATP_STATUS)
        qos.subscribe(self, topics.BRAKING_CURVE, self._on_curve)
        qos.subscribe(self, topics.STATE, self._on_state)
        qos.subscribe(self, topics.ATP_TARGET, self._on_target)
        period_s = 1.0 / watchdogs.check_rate_hz
        self.create_timer(period_s, partial(self._step, Tick.ROS))
        self.create_timer(period_s, partial(self._step, Tick.STEADY), clock=self._steady)

    def resume(self) -> None:
        """Begin with nothing: what was heard before it was deactivated tells of no train of now."""
        self._forget(self._known.refused_target)

    def _forget(self, refused_target: str = "") -> None:
        self._begun_ns = self._steady.now().nanoseconds
        self._known = Known(self._begun_ns, refused_target=refused_target)
        self._awaited = True
        """Whether the first state and curve may still be on their way."""
        self._decision: Decision | None = None

    def _on_curve(self, message: Any) -> None:
        self.heard[topics.BRAKING_CURVE] += 1
        try:
            curve = topics.BRAKING_CURVE.read(message, self._line)
        except Rejected as refusal:
            self._step(Refused(Part.CURVE, str(refusal)))
        else:
            against = f"its places run against direction = {self._line.direction!r}; is it the estimator's, too?"
            self._step(curve if curve.sign > 0 else Refused(Part.CURVE, against))

    def _on_state(self, message: Any) -> None:
        self.heard[topics.STATE] += 1
        try:
            self._step(topics.STATE.read(message, self._line))
        except Rejected as refusal:
            self._step(Refused(Part.STATE, str(refusal)))

    def _on_target(self, message: Any) -> None:
        """Set the parameters of the target; one that is not understood is an emergency until one that is comes."""
        self.heard[topics.ATP_TARGET] += 1
        try:
            target = topics.ATP_TARGET.read(message, self._line)
        except Rejected as refusal:
            self._step(Refused(Part.TARGET, str(refusal)))
            return
        asked = zip(TARGET, (self._line.sign * target.position_m, target.speed_mps / KMH), strict=True)
        result = self.set_parameters_atomically([Parameter(name, value=value) for name, value in asked])
        if not result.successful:
            self._step(Refused(Part.TARGET, result.reason))

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> Any:
        """Set parameters together, or none of them; a target holds, and ends the refusal of another, also unchanged."""
        result = super().set_parameters_atomically(parameter_list)
        if self.configured and result.successful and {each.name for each in parameter_list} & set(TARGET):
            self._step(Tick.TARGET)
        return result

    def _change(self, values: Mapping[str, Any]) -> Callable[[], None]:
        """A new target, or whatever of the supervision, holds from the next judgement on."""
        config = make(SupervisionConfig, values)

        def put_in_force() -> None:
            if self.configured:
                self._config = config
                self._step(Tick.RULES)

        return put_in_force

    def _step(self, event: Event) -> None:
        """Let the core take an event in; publish what it decides."""
        now = Now(self.get_clock().now().nanoseconds, self._steady.now().nanoseconds)
        self._known, decision = step(Rules(self._along_run(), self._clock_timeout_s), self._known, event, now)
        if decision is not None and self.active:
            self._publish(decision, now.ros_ns)

    def _publish(self, decision: Decision, now_ns: int) -> None:
        # Two judgements may see the same simulated clock; their stamps still increase.
        self._stamp_ns = self._stamp_ns + 1 if now_ns == self._now_ns else now_ns
        self._now_ns = now_ns
        changed = decision.level is not self._level
        awaited = self._awaited and self._may_be_awaited()
        overdue = self._awaited and not awaited and decision.severity is Severity.ERROR
        self._awaited = awaited
        self._decision = decision
        status = self._diagnostics.status(*self._told())
        self._status.publish(topics.ATP_STATUS.build(new, self._stamp_ns, status))
        self.published[topics.ATP_STATUS] += 1
        if changed or overdue:
            _log(self, decision, awaited)
            self._diagnostics.tell()

    def _may_be_awaited(self) -> bool:
        """Whether state and curve have not both come yet, and it is early days by the machine's own clock."""
        runs_s = (self._steady.now().nanoseconds - self._begun_ns) / NS_PER_S
        silent = self._known.state is SILENCE or self._known.curve is SILENCE
        return runs_s < GRACE_S and silent and not self._known.refused_target

    def _along_run(self) -> SupervisionConfig:
        return replace(self._config, target_position_m=self._line.sign * self._config.target_position_m)

    @property
    def _level(self) -> Level | None:
        return None if self._decision is None else self._decision.level

    def _told(self) -> Told:
        if self._decision is None:
            return [Finding(Severity.ERROR, "nothing judged yet: does the clock run?")], {}
        finding = Finding(self._decision.severity, self._decision.message)
        unheard = [topic for topic in (*INPUTS, topics.ATP_TARGET) if not self.heard[topic]]
        return [finding, *unlike(self, unheard), *doubled(self, INPUTS)], self._decision.numbers(self._config)


def _log(node: Node, decision: Decision, awaited: bool) -> None:
    known = decision.reading
    margin = "" if known is None else f" ({known.margin_m:.0f} m before the emergency brake)"
    text = f"{decision.level.name}: {decision.message}{margin}"
    if awaited:
        node.get_logger().info(f"waiting for the first estimate; until then {text}")
    elif decision.severity is Severity.OK:
        node.get_logger().info(text)
    elif decision.severity is Severity.WARN:
        node.get_logger().warning(text)
    else:
        node.get_logger().error(text)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node as a program."""
    return runtime.run("atp_monitor", AtpMonitor, args, PARAMETERS, EXAMPLES)


if __name__ == "__main__":
    sys.exit(main())

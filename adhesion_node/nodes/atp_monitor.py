# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The ATP monitor: supervises a target with the braking curve and says what has to be done.

::

    adhesion/state, adhesion/braking_curve, atp/target  ->  atp/status, /diagnostics

It judges a state and the curve made of it as a pair. Two watchdogs judge when no pair comes, because silence is no
message: one on the ROS clock, and one on the machine's own for the case that the ROS clock stands still.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.atp.plausibility import Course
from adhesion_node.core.atp.received import NS_PER_S, StampedCurve, TrainState, Unavailable
from adhesion_node.core.atp.supervision import Decision, Level, Severity, decide, unsafe
from adhesion_node.core.physics.train import KMH
from adhesion_node.core.setting import make
from adhesion_node.wire import topics
from adhesion_node.wire.codecs import Line, Rejected
from adhesion_node.wire.shared_settings import ATP_SETTINGS, Watchdogs
from adhesion_node.wire.topics import Topic

from .ros import qos, runtime
from .ros.diagnostics import Diagnostics, Finding, Told
from .ros.managed import ManagedNode
from .ros.params import current, declare
from .ros.types import new

PARAMETERS = ATP_SETTINGS

EXAMPLES = (
    "atp_monitor --ros-args -p target_position_m:=6000.0 -p target_speed_kmh:=100.0",
    "atp_monitor --ros-args -p target_position_m:=8200.0 -p target_speed_kmh:=0.0 -p use_sim_time:=true",
)

GRACE_S = 10.0
"""So long after the start silence is logged as waiting; the level is EMERGENCY_BRAKE from the first judgement on."""

_SILENCE = "none received yet; is the estimator running, are topic names and QoS right?"


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
        self._now_ns = self._stamp_ns = self._seen_ns = 0
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
        self._refused_target = ""
        self._forget()
        self._status = qos.advertise(self, topics.ATP_STATUS)
        qos.subscribe(self, topics.BRAKING_CURVE, self._on_curve)
        qos.subscribe(self, topics.STATE, self._on_state)
        qos.subscribe(self, topics.ATP_TARGET, self._on_target)
        period_s = 1.0 / watchdogs.check_rate_hz
        self.create_timer(period_s, self._on_watchdog)
        self.create_timer(period_s, self._on_steady_watchdog, clock=self._steady)

    def resume(self) -> None:
        """Begin with nothing: what was heard before it was deactivated tells of no train of now."""
        self._forget()

    def _forget(self) -> None:
        self._state: TrainState | Unavailable = Unavailable(_SILENCE)
        self._curve: StampedCurve | Unavailable = Unavailable(_SILENCE)
        self._course = Course()
        self._judged = self._apart = False
        self._moved_ns = self._begun_ns = self._steady.now().nanoseconds
        self._awaited = True
        """Whether the first state and curve may still be on their way."""
        self._decision: Decision | None = None

    def _on_curve(self, message: Any) -> None:
        self.heard[topics.BRAKING_CURVE] += 1
        try:
            curve = topics.BRAKING_CURVE.read(message, self._line)
            against = f"its places run against direction = {self._line.direction!r}; is it the estimator's, too?"
            self._curve = curve if curve.sign > 0 else Unavailable(against)
        except Rejected as refusal:
            self._curve = Unavailable(f"refused: {refusal}")
        self._judge_pair()

    def _on_state(self, message: Any) -> None:
        self.heard[topics.STATE] += 1
        try:
            state = topics.STATE.read(message, self._line)
            self._course = self._course.after(state)
            complaint = self._course.complaint(self._config)
            self._state = Unavailable(complaint) if complaint else state
        except Rejected as refusal:
            self._state = Unavailable(f"refused: {refusal}")
        self._judge_pair()

    def _on_target(self, message: Any) -> None:
        """Set the parameters of the target; one that is not understood is an emergency until one that is comes."""
        self.heard[topics.ATP_TARGET] += 1
        try:
            target = topics.ATP_TARGET.read(message, self._line)
            asked = {
                "target_position_m": self._line.sign * target.position_m,
                "target_speed_kmh": target.speed_mps / KMH,
            }
            result = self.set_parameters_atomically([Parameter(name, value=value) for name, value in asked.items()])
            self._refused_target = "" if result.successful else result.reason
        except Rejected as refusal:
            self._refused_target = str(refusal)
        self._judge()

    def _change(self, values: Mapping[str, Any]) -> Callable[[], None]:
        """A new target, or whatever of the supervision, holds from the next judgement on."""
        config = make(SupervisionConfig, values)

        def put_in_force() -> None:
            if self.configured:
                self._config, self._refused_target = config, ""
                self._judge()

        return put_in_force

    def _judge_pair(self) -> None:
        """Judge, unless the other half is still on its way: then a watchdog waits for it as for one that is silent."""
        apart = (
            isinstance(self._state, TrainState)
            and isinstance(self._curve, StampedCurve)
            and self._state.t_ns != self._curve.t_ns
        )
        if not apart:
            self._judge()
        elif not self._apart:
            self._judged = True
        self._apart = apart

    def _on_watchdog(self) -> None:
        if not self._judged:
            self._judge()
        self._judged = False

    def _on_steady_watchdog(self) -> None:
        if self._clock_stands_s() > self._clock_timeout_s:
            self._judge()

    def _clock_stands_s(self) -> float:
        """How long, by the machine's own clock, the ROS clock has been seen at the same time."""
        now_ns, steady_ns = self.get_clock().now().nanoseconds, self._steady.now().nanoseconds
        if now_ns != self._seen_ns:
            self._seen_ns, self._moved_ns = now_ns, steady_ns
        return (steady_ns - self._moved_ns) / NS_PER_S

    def _judge(self) -> None:
        if not self.active:
            return
        stands_s = self._clock_stands_s()
        now_ns = self.get_clock().now().nanoseconds
        # Two judgements may see the same simulated clock; their stamps still increase.
        self._stamp_ns = self._stamp_ns + 1 if now_ns == self._now_ns else now_ns
        self._now_ns = now_ns
        if stands_s > self._clock_timeout_s:
            decision = unsafe(f"the clock has stood still for {stands_s:.3g} s; is /clock published?")
        elif self._refused_target:
            decision = unsafe(f"target: refused: {self._refused_target}")
        else:
            decision = decide(self._along_run(), now_ns, self._state, self._curve, self._level or Level.NORMAL)
        changed = decision.level is not self._level
        awaited = self._awaited and self._may_be_awaited()
        overdue = self._awaited and not awaited and decision.severity is Severity.ERROR
        self._awaited = awaited
        self._decision, self._judged = decision, True
        status = self._diagnostics.status(*self._told())
        self._status.publish(topics.ATP_STATUS.build(new, self._stamp_ns, status))
        self.published[topics.ATP_STATUS] += 1
        if changed or overdue:
            _log(self, decision, awaited)
            self._diagnostics.tell()

    def _may_be_awaited(self) -> bool:
        """Whether state and curve have not both come yet, and it is early days by the machine's own clock."""
        runs_s = (self._steady.now().nanoseconds - self._begun_ns) / NS_PER_S
        return runs_s < GRACE_S and Unavailable(_SILENCE) in (self._state, self._curve) and not self._refused_target

    def _along_run(self) -> SupervisionConfig:
        return replace(self._config, target_position_m=self._line.sign * self._config.target_position_m)

    @property
    def _level(self) -> Level | None:
        return None if self._decision is None else self._decision.level

    def _told(self) -> Told:
        if self._decision is None:
            return [Finding(Severity.ERROR, "nothing judged yet: does the clock run?")], {}
        finding = Finding(self._decision.severity, self._decision.message)
        return [finding], self._decision.numbers(self._config)


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
    return runtime.run(AtpMonitor, args, PARAMETERS, EXAMPLES)

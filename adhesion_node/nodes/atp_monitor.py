"""The ATP monitor: compares the braking curve with a target and says what has to be done.

    adhesion/state, adhesion/braking_curve  ->  atp/status

It judges at each state; a watchdog on the ROS clock judges when no state comes, because silence is no message.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from adhesion_node import reading, topics
from adhesion_node.core.supervision import (
    Decision,
    Level,
    Severity,
    StampedCurve,
    Target,
    TrainState,
    Unavailable,
    decide,
)

from . import convert, qos, runtime
from .params import Spec, declare

_DEFAULTS = Target()

PARAMETERS = (
    Spec("target_position_m", _DEFAULTS.target_position_m, "place of the target along the track", "m", -1e7, 1e7),
    Spec("target_speed_kmh", _DEFAULTS.target_speed_kmh, "speed allowed at the target", "km/h", 0.0, 500.0),
    Spec("warning_margin_m", _DEFAULTS.warning_margin_m, "margin that warns", "m", 0.0, 1e5),
    Spec("service_margin_m", _DEFAULTS.service_margin_m, "margin that calls for the service brake", "m", 0.0, 1e5),
    Spec("reaction_time_s", _DEFAULTS.reaction_time_s, "time until the brakes are built up", "s", 0.0, 60.0),
    Spec("valid_for_s", _DEFAULTS.valid_for_s, "age up to which a curve and a state are used", "s", 0.01, 3600.0),
    Spec("check_rate_hz", 5.0, "rate of the watchdog on the ROS clock", "Hz", 0.1, 100.0),
)

_SILENCE = "none received yet; is the estimator running, are topic names and QoS right?"


class AtpMonitor(Node):
    """Says NORMAL, WARNING, SERVICE_BRAKE or EMERGENCY_BRAKE from the distance left before a target."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("atp_monitor", automatically_declare_parameters_from_overrides=True, **kwargs)
        values = declare(self, PARAMETERS)
        check_rate_hz = values.pop("check_rate_hz")
        self._target = Target(**values)
        self._state: TrainState | Unavailable = Unavailable(_SILENCE)
        self._curve: StampedCurve | Unavailable = Unavailable(_SILENCE)
        self._judged = False
        self._now_ns = self._stamp_ns = 0
        self._level: Level | None = None
        self._status = qos.advertise(self, topics.ATP_STATUS, qos.RESULT)
        qos.subscribe(self, topics.BRAKING_CURVE, self._on_curve, qos.LATCHED)
        qos.subscribe(self, topics.STATE, self._on_state, qos.RESULT)
        self.create_timer(1.0 / check_rate_hz, self._on_watchdog)

    def _on_curve(self, message: Any) -> None:
        try:
            self._curve = StampedCurve(*convert.curve(message))
        except reading.Rejected as refusal:
            self._curve = Unavailable(f"refused: {refusal}")

    def _on_state(self, message: Any) -> None:
        try:
            self._state = convert.state(message)
        except reading.Rejected as refusal:
            self._state = Unavailable(f"refused: {refusal}")
        self._judge()

    def _on_watchdog(self) -> None:
        if not self._judged:
            self._judge()
        self._judged = False

    def _judge(self) -> None:
        now_ns = self.get_clock().now().nanoseconds
        decision = decide(self._target, now_ns, self._state, self._curve)
        # Two judgements may see the same simulated clock; their stamps still increase.
        self._stamp_ns = self._stamp_ns + 1 if now_ns == self._now_ns else now_ns
        self._now_ns = now_ns
        self._status.publish(status_message(self._stamp_ns, self._target, decision))
        self._judged = True
        if decision.level is not self._level:
            self._level = decision.level
            _log(self, decision)


def status_message(t_ns: int, target: Target, decision: Decision) -> DiagnosticArray:
    """Build the status: level and every number behind it; a number that is not known has no key."""
    numbers = {
        "margin_m": decision.margin_m,
        "braking_distance_m": decision.braking_distance_m,
        "reaction_distance_m": decision.reaction_distance_m,
        "curve_age_s": decision.curve_age_s,
        "state_age_s": decision.state_age_s,
        **{field.name: getattr(target, field.name) for field in fields(target)},
    }
    status = DiagnosticStatus(
        level=bytes([decision.severity]),
        name="atp_monitor/supervision",
        message=decision.message,
        values=[KeyValue(key="level", value=decision.level.name)]
        + [KeyValue(key=key, value=f"{value:.3f}") for key, value in numbers.items() if value is not None],
    )
    return DiagnosticArray(header=convert.header(t_ns), status=[status])


def _log(node: Node, decision: Decision) -> None:
    margin = "" if decision.margin_m is None else f" (margin {decision.margin_m:.0f} m)"
    text = f"{decision.level.name}: {decision.message}{margin}"
    if decision.severity is Severity.OK:
        node.get_logger().info(text)
    elif decision.severity is Severity.WARN:
        node.get_logger().warning(text)
    else:
        node.get_logger().error(text)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node as a program."""
    return runtime.run(AtpMonitor, args, PARAMETERS)

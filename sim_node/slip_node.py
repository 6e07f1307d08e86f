"""The slip simulator: publishes a pulling locomotive's creep sensors, the surface's truth and /clock.

    wheel_speed, speed, traction_force  measurements, one stamp per sample
    truth/mu                            mu_max of the surface under the axles
    /clock                              time of the sample

It paces itself as the simulator does, by the monotonic clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.timer import Timer
from std_msgs.msg import Float64

from adhesion_node import topics
from adhesion_node.nodes import runtime
from adhesion_node.nodes.params import Spec, declare
from adhesion_node.nodes.qos import SENSOR_PUBLISHER, advertise

from . import messages, slip, slip_scenario
from .node import SHORTEST_TIMER_S, due

_NOISE = slip.SlipNoise()

PARAMETERS = (
    Spec("scenario", "creep_switch", "what happens", choices=tuple(slip_scenario.SCENARIOS)),
    Spec("seed", 1, "seed of the sensors' noise", "", 0, 2**31 - 1),
    Spec("rate_hz", 100.0, "samples per simulated second", "Hz", 1.0, 1000.0),
    Spec("real_time_factor", 1.0, "simulated seconds per second; 0 = as fast as possible", "", 0.0, 1000.0),
    Spec("start_time_s", 1000.0, "stamp of the first sample", "s", 0.0, 2e9),
    Spec("wait_for", 0, "start when so many subscribers to wheel_speed are there", "", 0, 100),
    Spec("exit_at_end", True, "end the program with the scenario"),
    Spec("wheel_std_radps", _NOISE.wheel_std_radps, "noise of a wheel speed", "rad/s", 0.0, 10.0),
    Spec("speed_std_mps", _NOISE.speed_std_mps, "noise of the train's speed", "m/s", 0.0, 10.0),
    Spec("force_std_n", _NOISE.force_std_n, "noise of the traction force", "N", 0.0, 1e6),
)

EXAMPLES = ("slip_simulator --ros-args -p scenario:=creep_dry -p wait_for:=1",)

OUTPUTS = (topics.CLOCK, topics.TRUTH_MU, topics.SPEED, topics.TRACTION_FORCE, topics.WHEEL_SPEED)
"""What the node publishes, in the order of publishing."""


class SlipSimulator(Node):
    """Simulates a pulling locomotive: publishes its creep sensors, the truth and /clock until the scenario ends."""

    def __init__(self, *, paced: bool = True, **kwargs: Any) -> None:
        """Read the parameters; ValueError when one is out of range.

        With `paced=False` the node has no timer: its owner asks for every sample by `tick`.
        """
        super().__init__("slip_simulator", automatically_declare_parameters_from_overrides=True, **kwargs)
        self.finished = False
        values = declare(self, PARAMETERS)
        self._scenario = slip_scenario.find(values["scenario"])
        self._noise = slip.SlipNoise(**{field.name: values[field.name] for field in fields(slip.SlipNoise)})
        self._period_s = 1.0 / values["rate_hz"]
        self._factor = values["real_time_factor"]
        self._wait_for = values["wait_for"]
        self._exit_at_end = values["exit_at_end"]
        self._start_ns = round(values["start_time_s"] * 1e9)
        self._samples = slip.run(self._scenario, self._period_s, values["seed"], self._noise)
        self._published = 0
        self._mu_max = 0.0
        self._monotonic = Clock(clock_type=ClockType.STEADY_TIME)
        self._begun_ns: int | None = None
        self._outputs = {topic: advertise(self, topic, SENSOR_PUBLISHER) for topic in OUTPUTS}
        period_s = self._period_s / self._factor if self._factor else 0.0
        self._timer: Timer | None = (
            self.create_timer(max(period_s, SHORTEST_TIMER_S), self._on_timer, clock=self._monotonic) if paced else None
        )

    def tick(self) -> bool:
        """Publish the next sample; False when the scenario has ended and nothing was published."""
        sample = next(self._samples, None)
        if sample is None:
            self._end()
            return False
        truth, reading = sample
        self._report(truth)
        t_ns = self._start_ns + truth.t_ns
        for topic, message in (
            (topics.CLOCK, messages.clock(t_ns)),
            (topics.TRUTH_MU, Float64(data=truth.mu_max)),
            (topics.SPEED, messages.speed(t_ns, reading.speed_mps, self._noise.speed_std_mps)),
            (topics.TRACTION_FORCE, messages.traction_force(t_ns, reading.force_n)),
            (topics.WHEEL_SPEED, messages.wheel_speed(t_ns, reading.wheel_radps)),
        ):
            self._outputs[topic].publish(message)
        self._published += 1
        return True

    def _on_timer(self) -> None:
        now_ns = self._monotonic.now().nanoseconds
        if self._begun_ns is None:
            if self._outputs[topics.WHEEL_SPEED].get_subscription_count() < self._wait_for:
                return
            self._begun_ns = now_ns
        for _ in range(due(now_ns - self._begun_ns, self._factor, self._period_s, self._published)):
            if not self.tick():
                return

    def _report(self, truth: slip.SlipTruth) -> None:
        if not self._published:
            self.get_logger().info(f"scenario {self._scenario.name}: started at {self._start_ns / 1e9:.1f} s")
        if truth.mu_max != self._mu_max:
            self._mu_max = truth.mu_max
            self.get_logger().info(f"{truth.t_ns / 1e9:.1f} s: mu_max {truth.mu_max:.3f} at {truth.position_m:.0f} m")

    def _end(self) -> None:
        if self.finished:
            return
        self.finished = self._exit_at_end
        if self._timer is not None and not self._timer.is_canceled():
            self._timer.cancel()
            self.get_logger().info(f"scenario {self._scenario.name}: ended after {self._published} samples")


def main(args: Sequence[str] | None = None) -> int:
    """Run the slip simulator until its scenario ends or a signal comes."""
    return runtime.run(SlipSimulator, args, PARAMETERS, EXAMPLES)

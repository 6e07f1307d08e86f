# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The slip simulator: publishes a pulling locomotive's creep sensors, the surface's truth and /clock.

    wheel_speed, speed, traction_force  measurements, one stamp per sample
    truth/mu                            mu_max of the surface under the axles
    /clock                              time of the sample

It paces itself as the simulator does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rclpy.node import Node

from adhesion_node.core.setting import make
from adhesion_node.nodes.ros import runtime
from adhesion_node.nodes.ros.params import declare
from adhesion_node.nodes.ros.qos import advertise
from adhesion_node.nodes.ros.types import new
from adhesion_node.wire import topics

from ..settings import SLIP_SIMULATOR
from ..slip import plant as slip
from ..slip import scenario as slip_scenario
from .pace import Pace

PARAMETERS = SLIP_SIMULATOR

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
        self._noise = make(slip.SlipNoise, values)
        self._exit_at_end = values["exit_at_end"]
        self._start_ns = round(values["start_time_s"] * 1e9)
        period_s, subscribers = 1.0 / values["rate_hz"], values["wait_for"]
        self._samples = slip.run(self._scenario, period_s, values["seed"], self._noise)
        self._published = 0
        self._mu_max = 0.0
        self._ended = False
        self._outputs = {topic: advertise(self, topic) for topic in OUTPUTS}
        if paced:
            awaited = self._outputs[topics.WHEEL_SPEED]
            factor = values["real_time_factor"]
            Pace(self, period_s, factor, lambda: awaited.get_subscription_count() >= subscribers, self.tick)

    def tick(self) -> bool:
        """Publish the next sample; False when the scenario has ended and nothing was published."""
        sample = next(self._samples, None)
        if sample is None:
            self._end()
            return False
        truth, reading = sample
        self._report(truth)
        t_ns = self._start_ns + truth.t_ns
        self._send(topics.CLOCK, t_ns)
        self._send(topics.TRUTH_MU, truth.mu_max)
        self._send(topics.SPEED, t_ns, (reading.speed_mps,), self._noise.speed_std_mps**2)
        self._send(topics.TRACTION_FORCE, t_ns, (reading.force_n,))
        self._send(topics.WHEEL_SPEED, t_ns, reading.wheel_radps)
        self._published += 1
        return True

    def _send(self, topic: topics.Topic, *values: Any) -> None:
        self._outputs[topic].publish(topic.build(new, *values))

    def _report(self, truth: slip.SlipTruth) -> None:
        if not self._published:
            self.get_logger().info(f"scenario {self._scenario.name}: started at {self._start_ns / 1e9:.1f} s")
        if truth.mu_max != self._mu_max:
            self._mu_max = truth.mu_max
            self.get_logger().info(f"{truth.t_ns / 1e9:.1f} s: mu_max {truth.mu_max:.3f} at {truth.position_m:.0f} m")

    def _end(self) -> None:
        if self._ended:
            return
        self._ended = True
        self.finished = self._exit_at_end
        self.get_logger().info(f"scenario {self._scenario.name}: ended after {self._published} samples")


def main(args: Sequence[str] | None = None) -> int:
    """Run the slip simulator until its scenario ends or a signal comes."""
    return runtime.run(SlipSimulator, args, PARAMETERS, EXAMPLES)

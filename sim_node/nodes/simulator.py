# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The simulator: publishes a scenario's sensors, its truth and /clock.

    position, brake_pressure            measurements, one stamp per sample
    speed, wheel_speed                  more of them, where their noise is above 0
    truth/state, truth/mu               the true train
    /clock                              time of the sample

The parameter `fault` lets something go wrong; `faults` lists what.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rclpy.node import Node

from adhesion_node.core.physics.train import KMH
from adhesion_node.core.setting import make
from adhesion_node.nodes.ros import runtime
from adhesion_node.nodes.ros.params import declare
from adhesion_node.nodes.ros.qos import advertise
from adhesion_node.nodes.ros.types import new
from adhesion_node.wire import topics

from ..faults.plan import Plan, faulty_run, period_of
from ..settings import SIMULATOR
from ..train import scenario
from ..train.messages import SensorMessage
from ..train.plant import Truth
from ..train.sensors import SensorSettings
from .pace import Pace

PARAMETERS = SIMULATOR

EXAMPLES = (
    "simulator --ros-args -p scenario:=tunnel_exit -p seed:=2",
    "simulator --ros-args -p real_time_factor:=10.0 -p wait_for:=1",
)


class Simulator(Node):
    """Simulates a braking train: publishes its sensors, the truth and /clock until the scenario ends.

    The parameter `scenario` says what happens, `fault` what goes wrong, `seed` which noise, `real_time_factor` how
    fast.
    """

    def __init__(self, *, paced: bool = True, **kwargs: Any) -> None:
        """Read the parameters; ValueError when one is out of range.

        With `paced=False` the node has no timer: its owner asks for every sample by `tick`.
        """
        super().__init__("simulator", automatically_declare_parameters_from_overrides=True, **kwargs)
        self.finished = False
        values = declare(self, PARAMETERS)
        settings, plan = make(SensorSettings, values), make(Plan, values)
        self._scenario = scenario.find(values["scenario"])
        self._exit_at_end = values["exit_at_end"]
        self._start_ns = round(values["start_time_s"] * 1e9)
        period_s = period_of(plan, 1.0 / values["rate_hz"])
        self._ticks = faulty_run(plan, self._scenario, period_s, values["seed"], settings)
        self.samples = 0
        """Number of samples published."""
        self.now_ns = 0
        """Time of the newest one, as on /clock."""
        self._regime = ""
        self._ended = False
        optional = ((topics.SPEED, settings.speed_std_mps), (topics.WHEEL_SPEED, settings.wheel_speed_std_radps))
        there = (topics.BRAKE_PRESSURE, *(topic for topic, std in optional if std > 0), topics.POSITION)
        self._outputs = {topic: advertise(self, topic) for topic in (topics.CLOCK, *topics.TRUTH, *there)}
        if paced:
            self._wait_for(values["wait_for"], period_s, values["real_time_factor"])

    def tick(self) -> bool:
        """Publish the next sample; False when the scenario has ended and nothing was published."""
        sample = next(self._ticks, None)
        if sample is None:
            self._end()
            return False
        self._report(sample[0])
        self._publish(*sample)
        self.samples += 1
        return True

    def _wait_for(self, subscribers: int, period_s: float, factor: float) -> None:
        if subscribers:
            _log(self, f"waiting for {subscribers} subscriber(s) to {topics.POSITION.name}")
        awaited = self._outputs[topics.POSITION]
        Pace(self, period_s, factor, lambda: awaited.get_subscription_count() >= subscribers, self.tick)

    def _publish(self, truth: Truth, sent: Sequence[SensorMessage]) -> None:
        t_ns = self.now_ns = self._start_ns + truth.t_ns
        self._send(topics.CLOCK, t_ns)
        self._send(topics.TRUTH_STATE, t_ns, truth.position_m, truth.speed_mps)
        self._send(topics.TRUTH_MU, truth.mu)
        for one in sent:
            stamped = one._replace(t_ns=max(self._start_ns + one.t_ns, 0))
            self._outputs[one.topic].publish(stamped.build(new))

    def _send(self, topic: topics.Topic, *values: float) -> None:
        self._outputs[topic].publish(topic.build(new, *values))

    def _report(self, truth: Truth) -> None:
        if not self.samples:
            _log(self, f"scenario {self._scenario.name}: started at {self._start_ns / 1e9:.1f} s")
        if truth.regime != self._regime:
            self._regime = truth.regime
            _log(
                self, f"{truth.t_ns / 1e9:.1f} s: {truth.regime} at {truth.speed_mps / KMH:.0f} km/h, mu {truth.mu:.4f}"
            )

    def _end(self) -> None:
        if self._ended:
            return
        self._ended = True
        self.finished = self._exit_at_end
        _log(self, f"scenario {self._scenario.name}: ended after {self.samples} samples")


def _log(node: Node, text: str) -> None:
    node.get_logger().info(text)


def main(args: Sequence[str] | None = None) -> int:
    """Run the simulator until its scenario ends or a signal comes."""
    return runtime.run(Simulator, args, PARAMETERS, EXAMPLES)

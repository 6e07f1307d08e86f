"""The simulator: publishes a scenario's sensors, its truth and /clock.

    position, brake_pressure            measurements, one stamp per sample
    speed, wheel_speed                  more of them, where their noise is above 0
    truth/state, truth/mu               the true train
    /clock                              time of the sample

The node paces itself by the monotonic clock and never follows /clock, which is its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.timer import Timer

from adhesion_node import topics
from adhesion_node.core.train import KMH
from adhesion_node.nodes import runtime
from adhesion_node.nodes.params import Spec, declare
from adhesion_node.nodes.qos import SENSOR_PUBLISHER, advertise

from . import messages, scenario
from .plant import Truth
from .run import run
from .sensors import Reading, SensorSettings

MAX_BURST = 10
"""Samples that one timer callback publishes at most, so that the node stays responsive while it catches up."""

SHORTEST_TIMER_S = 1e-3

_NOISE = SensorSettings()

# name, default, meaning, unit, least and most
PARAMETERS = (
    Spec("scenario", "tunnel_entry", "what happens", choices=tuple(scenario.SCENARIOS)),
    Spec("seed", 1, "seed of the plant's and the sensors' noise", "", 0, 2**31 - 1),
    Spec("rate_hz", 10.0, "samples per simulated second", "Hz", 0.1, 1000.0),
    Spec("real_time_factor", 1.0, "simulated seconds per second; 0 = as fast as possible", "", 0.0, 1000.0),
    Spec("start_time_s", 1000.0, "stamp of the first sample", "s", 0.0, 2e9),
    Spec("wait_for", 0, "start when so many subscribers to position are there", "", 0, 100),
    Spec("exit_at_end", True, "end the program with the scenario"),
    Spec("position_std_m", _NOISE.position_std_m, "noise of the position", "m", 1e-3, 100.0),
    Spec("student_dof", _NOISE.student_dof, "0, or degrees of freedom of Student-t position noise", "", 0.0, 100.0),
    Spec("outlier_fraction", _NOISE.outlier_fraction, "fraction of positions that are outliers", "", 0.0, 1.0),
    Spec("outlier_size_m", _NOISE.outlier_size_m, "size of an outlier", "m", 0.0, 1e4),
    Spec("dropout_fraction", _NOISE.dropout_fraction, "fraction of positions that are missing", "", 0.0, 1.0),
    Spec("pressure_std_pa", _NOISE.pressure_std_pa, "noise of the brake pressure", "Pa", 0.0, 1e5),
    Spec("speed_std_mps", _NOISE.speed_std_mps, "noise of the speed; 0 = no odometer", "m/s", 0.0, 10.0),
    Spec(
        "wheel_speed_std_radps",
        _NOISE.wheel_speed_std_radps,
        "noise of the wheel speeds; 0 = no wheel-speed sensors",
        "rad/s",
        0.0,
        10.0,
    ),
)

EXAMPLES = (
    "simulator --ros-args -p scenario:=tunnel_exit -p seed:=2",
    "simulator --ros-args -p real_time_factor:=10.0 -p wait_for:=1",
)


class Simulator(Node):
    """Simulates a braking train: publishes its sensors, the truth and /clock until the scenario ends.

    The parameter `scenario` says what happens, `seed` which noise, `real_time_factor` how fast.
    """

    def __init__(self, *, paced: bool = True, **kwargs: Any) -> None:
        """Read the parameters; ValueError when one is out of range.

        With `paced=False` the node has no timer: its owner asks for every sample by `tick`.
        """
        super().__init__("simulator", automatically_declare_parameters_from_overrides=True, **kwargs)
        self.finished = False
        values = declare(self, PARAMETERS)
        self._settings = SensorSettings(**{field.name: values[field.name] for field in fields(SensorSettings)})
        self._scenario = scenario.find(values["scenario"])
        self._period_s = 1.0 / values["rate_hz"]
        self._factor = values["real_time_factor"]
        self._wait_for = values["wait_for"]
        self._exit_at_end = values["exit_at_end"]
        self._start_ns = round(values["start_time_s"] * 1e9)
        self._samples = run(self._scenario, self._period_s, values["seed"], self._settings)
        self._published = 0
        self._regime = ""
        self._ended = False
        # Not the node's clock: with use_sim_time it would stand still until this node moves it.
        self._monotonic = Clock(clock_type=ClockType.STEADY_TIME)
        self._begun_ns: int | None = None

        self._clock_out = advertise(self, topics.CLOCK, SENSOR_PUBLISHER)
        self._truth_state_out = advertise(self, topics.TRUTH_STATE, SENSOR_PUBLISHER)
        self._truth_mu_out = advertise(self, topics.TRUTH_MU, SENSOR_PUBLISHER)
        self._pressure_out = advertise(self, topics.BRAKE_PRESSURE, SENSOR_PUBLISHER)
        has_odometer = self._settings.speed_std_mps > 0
        self._speed_out = advertise(self, topics.SPEED, SENSOR_PUBLISHER) if has_odometer else None
        has_wheels = self._settings.wheel_speed_std_radps > 0
        self._wheels_out = advertise(self, topics.WHEEL_SPEED, SENSOR_PUBLISHER) if has_wheels else None
        self._position_out = advertise(self, topics.POSITION, SENSOR_PUBLISHER)
        if paced and self._wait_for:
            _log(self, f"waiting for {self._wait_for} subscriber(s) to {topics.POSITION.name}")
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
        self._report(sample[0])
        self._publish(*sample)
        self._published += 1
        return True

    def _publish(self, truth: Truth, reading: Reading) -> None:
        t_ns = self._start_ns + truth.t_ns
        noise = self._settings
        self._clock_out.publish(messages.clock(t_ns))
        self._truth_state_out.publish(messages.truth_state(t_ns, truth))
        self._truth_mu_out.publish(messages.truth_mu(truth))
        self._pressure_out.publish(messages.brake_pressure(t_ns, reading.pressure_pa, noise.pressure_std_pa))
        if self._speed_out is not None and reading.speed_mps is not None:
            self._speed_out.publish(messages.speed(t_ns, reading.speed_mps, noise.speed_std_mps))
        if self._wheels_out is not None and reading.wheel_radps is not None:
            self._wheels_out.publish(messages.wheel_speed(t_ns, reading.wheel_radps))
        if reading.position_m is not None:
            self._position_out.publish(messages.position(t_ns, reading.position_m, noise.position_std_m))

    def _on_timer(self) -> None:
        now_ns = self._monotonic.now().nanoseconds
        if self._begun_ns is None:
            if self._position_out.get_subscription_count() < self._wait_for:
                return
            self._begun_ns = now_ns
        for _ in range(due(now_ns - self._begun_ns, self._factor, self._period_s, self._published)):
            if not self.tick():
                return

    def _report(self, truth: Truth) -> None:
        if not self._published:
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
        if self._timer is not None:
            self._timer.cancel()
        _log(self, f"scenario {self._scenario.name}: ended after {self._published} samples")


def due(elapsed_ns: int, factor: float, period_s: float, published: int) -> int:
    """Samples to publish now, 0 to `MAX_BURST`.

    Rounded to the nearest sample, so that a timer that fires a little early does not put two into the next call.

    >>> due(0, 1.0, 0.1, 0), due(99_000_000, 1.0, 0.1, 1), due(10_000_000_000, 1.0, 0.1, 5), due(0, 0.0, 0.1, 50)
    (1, 1, 10, 10)
    """
    if factor == 0.0:
        return MAX_BURST
    total = math.floor(elapsed_ns / 1e9 * factor / period_s + 0.5) + 1
    return min(max(total - published, 0), MAX_BURST)


def _log(node: Node, text: str) -> None:
    node.get_logger().info(text)


def main(args: Sequence[str] | None = None) -> int:
    """Run the simulator until its scenario ends or a signal comes."""
    return runtime.run(Simulator, args, PARAMETERS, EXAMPLES)

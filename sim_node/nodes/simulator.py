# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The simulator: publishes a scenario's sensors, its truth and /clock.

    position, brake_pressure            measurements, one stamp per sample
    speed, wheel_speed                  more of them, where their noise is above 0
    truth/state, truth/mu               the true train; of a real one truth/limited, too
    /clock                              time of the sample

The parameter `fault` lets something go wrong. The scenarios of a real train have wheels, slide protection and the
`sensors` of such trains: each message comes when it arrives, and truth/mu is the adhesion that the train uses.
"""

import sys
from collections.abc import Iterator, Sequence
from typing import Any

from adhesion_node.core.atp.supervision import Severity
from adhesion_node.core.physics.train import KMH
from adhesion_node.core.setting import Setting, make, settings_of
from adhesion_node.nodes.ros import runtime
from adhesion_node.nodes.ros.diagnostics import Finding, Told
from adhesion_node.wire import topics
from adhesion_node.wire.messages.parts import NS
from adhesion_node.wire.topic import Topic

from ..faults.plan import FAULTS, NONE, Plan, active, faulty_run, period_of, told
from ..real.drive import drive
from ..real.plant.scenarios import SCENARIOS as REAL
from ..real.run import ticks
from ..real.sensors.fitted import FITTED
from ..settings import SENSORS, SIMULATOR
from ..train import scenario
from ..train.plant import ADHESION_LIMITED, Truth
from ..train.sensors import SensorMessage, SensorSettings, Tick
from .pace import RunNode

PARAMETERS = SIMULATOR

NOISE, FAULT = settings_of(SensorSettings), settings_of(Plan)
"""What a scenario of the paper heeds alone."""

EXAMPLES = (
    "simulator --ros-args -p scenario:=tunnel_exit -p seed:=2",
    "simulator --ros-args -p real_time_factor:=10.0 -p wait_for:=1",
    "simulator --ros-args -p scenario:=leaves -p sensors:=full",
)


class Simulator(RunNode):
    """Simulates a braking train: publishes its sensors, the truth and /clock until the scenario ends.

    The parameter `scenario` says what happens, `fault` what goes wrong, `seed` which noise, `real_time_factor` how
    fast.
    """

    def __init__(self, *, paced: bool = True, **kwargs: Any) -> None:
        """Read the parameters; ValueError when one is out of range. `paced` as in `RunNode.begin`."""
        super().__init__("simulator", PARAMETERS, **kwargs)
        self._real = self.values["scenario"] in REAL
        self._fault: list[tuple[float, str]] = []
        """When, s of the run, it begins and ends, in words."""
        self._refuse_unheeded()
        run, there, period_s = self._real_run() if self._real else self._run_of_paper()
        truth = topics.TRUTH if self._real else (topics.TRUTH_STATE, topics.TRUTH_MU)
        self.begin(run, (*truth, *there), period_s, paced=paced)

    def _refuse_unheeded(self) -> None:
        """Raise ValueError for the first parameter that is set though this scenario does not heed it."""
        if self._real:
            self._refuse((*NOISE, *FAULT), "a real train has its noise and faults by `sensors`: give none")
            return
        self._refuse((SENSORS,), "are those of a real train: leave them out, or choose a scenario of one")
        if self.values["fault"] == NONE:
            self._refuse(FAULT, "nothing goes wrong without `fault`: name one, or leave this out")
        sensor = FAULTS[self.values["fault"]].of
        if sensor and not self.values[sensor]:
            raise ValueError(f"fault = {self.values['fault']!r}: there is no such sensor: give {sensor} above 0")

    def _refuse(self, settings: Sequence[Setting], why: str) -> None:
        for one in settings:
            if self.values[one.name] != one.default:
                raise ValueError(f"{one.name} = {self.values[one.name]!r}: {why}")

    def _run_of_paper(self) -> tuple[Iterator[Tick], tuple[Topic, ...], float]:
        """The run, its topics and its period."""
        settings, plan = make(SensorSettings, self.values), make(Plan, self.values)
        self._fault = told(plan)
        period_s = period_of(plan, 1.0 / self.values["rate_hz"])
        happening = scenario.find(self.values["scenario"])
        run = faulty_run(plan, happening, period_s, self.values["seed"], settings)
        optional = ((topics.SPEED, settings.speed_std_mps), (topics.WHEEL_SPEED, settings.wheel_speed_std_radps))
        there = (topics.BRAKE_PRESSURE, *(topic for topic, std in optional if std > 0), topics.POSITION)
        return run, there, period_s

    def _real_run(self) -> tuple[Iterator[Tick], tuple[Topic, ...], float]:
        """The same of a real train; the period is that of truth and messages together."""
        (driven,) = drive(REAL[self.values["scenario"]], FITTED[self.values["sensors"]], [self.values["seed"]])
        sent = {message.topic for _, message in driven.messages}
        there = tuple(topic for topic in topics.ADHESION_INPUTS if topic in sent)
        per_s = self.values["rate_hz"] + len(driven.messages) / float(driven.journey.time_s[-1])
        return ticks(driven, 1.0 / self.values["rate_hz"]), there, 1.0 / per_s

    def told(self) -> Told:
        """Tell of the fault, too."""
        (findings, values), plan = super().told(), make(Plan, self.values)
        at_work = self.truth is not None and active(plan, self.truth)
        wanted = [Finding(Severity.WARN, f"fault {plan.fault}: {FAULTS[plan.fault].description}")] if at_work else []
        return [*findings, *wanted], {**values, "fault": plan.fault, "fault_active": str(at_work).lower()}

    def news(self, truth: Truth) -> tuple[str, str]:
        """Tell the regimes."""
        return truth.regime, f"{truth.regime} at {truth.speed_mps / KMH:.0f} km/h, mu {truth.mu:.4f}"

    def publish(self, truth: Truth, measured: Sequence[SensorMessage]) -> None:
        """Publish the truth, and the messages at the stamps that they bear; tell of the fault."""
        while self._fault and truth.t_ns / NS >= self._fault[0][0]:
            self.log("{:.1f} s: fault {}".format(*self._fault.pop(0)))
        if not (self._real and measured):
            self.send(topics.TRUTH_STATE, self.now_ns, truth.position_m, truth.speed_mps)
            self.send(topics.TRUTH_MU, truth.mu)
            if self._real:
                self.send(topics.TRUTH_LIMITED, truth.regime == ADHESION_LIMITED)
        for one in measured:
            t_ns = max(self.now_ns - truth.t_ns + one.t_ns, 0)
            self.send(one.topic, t_ns, one.values, one.variance, one.frame)


def main(args: Sequence[str] | None = None) -> int:
    """Run the simulator until its scenario ends or a signal comes."""
    return runtime.run("simulator", Simulator, args, PARAMETERS, EXAMPLES)


if __name__ == "__main__":
    sys.exit(main())

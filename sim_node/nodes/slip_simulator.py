# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The slip simulator: publishes a pulling locomotive's creep sensors, the surface's truth and /clock.

    wheel_speed, speed, traction_force  measurements, one stamp per sample
    truth/mu                            mu_max of the surface under the axles
    /clock                              time of the sample

It paces itself as the simulator does.
"""

import sys
from collections.abc import Sequence
from typing import Any

from adhesion_node.core.setting import make
from adhesion_node.nodes.ros import runtime
from adhesion_node.wire import topics

from ..settings import SLIP_SIMULATOR
from ..slip import plant as slip
from ..slip import scenario as slip_scenario
from .pace import RunNode

PARAMETERS = SLIP_SIMULATOR

EXAMPLES = ("slip_simulator --ros-args -p scenario:=creep_dry -p wait_for:=1",)


class SlipSimulator(RunNode):
    """Simulates a pulling locomotive: publishes its creep sensors, the truth and /clock until the scenario ends."""

    def __init__(self, *, paced: bool = True, **kwargs: Any) -> None:
        """Read the parameters; ValueError when one is out of range. `paced` as in `RunNode.begin`."""
        super().__init__("slip_simulator", PARAMETERS, **kwargs)
        self._noise = make(slip.SlipNoise, self.values)
        period_s, pull = 1.0 / self.values["rate_hz"], slip_scenario.find(self.values["scenario"])
        run = slip.run(pull, period_s, self.values["seed"], self._noise)
        self.begin(run, (topics.TRUTH_MU, *topics.CREEP_INPUTS), period_s, paced=paced)

    def news(self, truth: slip.SlipTruth) -> tuple[float, str]:
        """Tell the surfaces."""
        return truth.mu_max, f"mu_max {truth.mu_max:.3f} at {truth.position_m:.0f} m"

    def publish(self, truth: slip.SlipTruth, measured: slip.SlipReading) -> None:
        """Publish the truth and the readings."""
        self.send(topics.TRUTH_MU, truth.mu_max)
        self.send(topics.SPEED, self.now_ns, (measured.speed_mps,), self._noise.speed_std_mps**2)
        self.send(topics.TRACTION_FORCE, self.now_ns, (measured.force_n,))
        self.send(topics.WHEEL_SPEED, self.now_ns, measured.wheel_radps)


def main(args: Sequence[str] | None = None) -> int:
    """Run the slip simulator until its scenario ends or a signal comes."""
    return runtime.run("slip_simulator", SlipSimulator, args, PARAMETERS, EXAMPLES)


if __name__ == "__main__":
    sys.exit(main())

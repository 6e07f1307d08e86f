# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The estimator: position and brake pressure in, adhesion with its bound and the braking curves out.

::

    position, brake_pressure, speed, wheel_speed  ->  adhesion/*, /diagnostics
    ~/reset, ~/set_enabled                            services
"""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

from adhesion_node.core import Config, Estimate, Outcome, Regime
from adhesion_node.core.atp.supervision import Severity
from adhesion_node.core.bank.findings.learnt import learnt
from adhesion_node.core.estimator import warm_up
from adhesion_node.core.physics.train import KMH
from adhesion_node.run.pipeline import BACKWARDS, Pipeline
from adhesion_node.wire import topics
from adhesion_node.wire.settings.nodes import SETTINGS
from adhesion_node.wire.settings.setup import setup_of

from .ros import runtime
from .ros.diagnostics import Finding
from .ros.estimating import EstimatingNode, Kind, SetUp

PARAMETERS = SETTINGS

EXAMPLES = (
    "estimator",
    "estimator --ros-args -p train.mass_kg:=450000.0 -p track:='tunnel 3000 9000'",
    "estimator --ros-args --params-file my_parameters.yaml -r __ns:=/train1",
)

UNMEASURED = "no brake pressure: a full brake is assumed"
UNBRAKED = (
    "no brake pressure: mu is what slows the train, whether the adhesion limits is not told; publish brake_pressure"
    " or brake_demand"
)


class Estimator(EstimatingNode[Pipeline]):
    """Identifies the adhesion while the train brakes and publishes the braking curve that follows from it."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(KIND, **kwargs)

    @property
    def config(self) -> Config:
        """The configuration that the parameters gave."""
        return self.pipeline.config


def _set_up(values: Mapping[str, Any]) -> SetUp[Pipeline]:
    setup = setup_of(values)
    warm_up(setup.config)
    return SetUp(Pipeline(setup.config, setup.seed), setup.line, setup.sensor_timeout_s, setup.unread)


def _findings(pipeline: Pipeline) -> list[Finding]:
    """Return what is wrong, and in which regime the train is."""
    if pipeline.state.stuck:
        withheld = (
            "; mu is withheld, the curve on the low law" if pipeline.last is None or pipeline.last.withheld else ""
        )
        return [Finding(Severity.ERROR, f"position: {Outcome.STUCK.value}{withheld}")]
    if pipeline.last is None:
        return [Finding(Severity.WARN, "no estimate yet")]
    found = [Finding(Severity.OK, pipeline.last.regime.value)]
    if pipeline.runs_back:
        found.append(Finding(Severity.ERROR, BACKWARDS))
    newest = pipeline.state.newest
    if newest is not None and newest.brake_pressure_pa is None:
        if pipeline.state.memory is None:
            found.append(Finding(Severity.WARN, UNMEASURED))
        elif newest.demand_pa is None:
            found.append(Finding(Severity.WARN, UNBRAKED))
    return found


def _values(pipeline: Pipeline) -> dict[str, str]:
    """Return the numbers by name."""
    drops = {f"dropped.{reason}": str(count) for reason, count in pipeline.dropped.items()}
    counts = {
        "measurements": str(pipeline.measurements),
        "accepted": str(pipeline.accepted),
        "ticks": str(pipeline.ticks),
        "resets": str(pipeline.resets),
        "windows": str(pipeline.windows),
    }
    told = {"confidence": f"{pipeline.config.confidence:g}", "digest": pipeline.digest}
    memory = pipeline.state.memory
    taught = {} if memory is None else {name: f"{value:.5g}" for name, value in learnt(memory).items()}
    off_pa = pipeline.state.zero.off_pa(pipeline.config.least_pressure_pa)
    gauge = {"gauge_zero": f"{off_pa:.5g}"} if off_pa else {}
    return {**_estimate_values(pipeline.last), **taught, **gauge, **counts, **drops, **told}


def _estimate_values(last: Estimate | None) -> dict[str, str]:
    if last is None:
        return {"regime": Regime.COASTING.name}
    return {
        "regime": last.regime.name,
        "mu": f"{last.mu:.5f}",
        "mu_std": f"{last.mu_std:.5f}",
        "mu_lower": f"{last.mu_lower:.5f}",
        "window": str(last.window),
        "changes": str(last.changes),
        "iterations": str(last.iterations),
        "converged": str(last.converged).lower(),
        "log_likelihood": f"{last.log_likelihood:.3f}",
        "ess": f"{last.ess:.1f}",
    }


def _news(pipeline: Pipeline) -> tuple[Regime | None, str]:
    """What limits, and with which adhesion."""
    last = pipeline.last
    if last is None:
        return None, "no estimate yet"
    mu = "mu withheld" if last.withheld else f"mu {last.mu:.4f}, at least {last.mu_lower:.4f}"
    return last.regime, f"{last.regime.name} at {abs(last.speed_mps) / KMH:.0f} km/h, {mu}: {last.regime.value}"


KIND = Kind(
    "estimator", "adhesion", PARAMETERS, _set_up, topics.ADHESION_INPUTS, topics.RESULTS, _findings, _values, _news
)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node as a program."""
    return runtime.run("estimator", Estimator, args, PARAMETERS, EXAMPLES)


if __name__ == "__main__":
    sys.exit(main())

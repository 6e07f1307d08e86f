# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The creep estimator: wheel speeds, train speed and traction force in, the peak of the creep curve out.

::

    wheel_speed, speed, traction_force  ->  creep/mu_max, creep/lambda_m, /diagnostics
    ~/reset, ~/set_enabled                  services

Nothing is published on creep/* while the data cannot tell the peak; /diagnostics says why.
"""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

from adhesion_node.core.atp.supervision import Severity
from adhesion_node.core.creep.config import Peak
from adhesion_node.run.creep_pipeline import CreepPipeline
from adhesion_node.wire import topics
from adhesion_node.wire.settings.nodes import CREEP_SETTINGS
from adhesion_node.wire.settings.setup import creep_setup_of

from .ros import runtime
from .ros.diagnostics import Finding
from .ros.estimating import EstimatingNode, Kind, SetUp

PARAMETERS = CREEP_SETTINGS

EXAMPLES = ("creep_estimator", "creep_estimator --ros-args -p axles:=4 -p wheel_radius_m:=0.46")


class CreepEstimator(EstimatingNode[CreepPipeline]):
    """Identifies the creep curve while the train pulls and publishes its peak as soon as the data tell it."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(KIND, **kwargs)


def _set_up(values: Mapping[str, Any]) -> SetUp[CreepPipeline]:
    setup = creep_setup_of(values)
    return SetUp(CreepPipeline(setup.config), setup.line, setup.sensor_timeout_s)


def _findings(pipeline: CreepPipeline) -> list[Finding]:
    last = pipeline.last
    if last is None:
        return [Finding(Severity.OK, "no estimate yet")]
    return [Finding(Severity.OK if last.known else Severity.WARN, last.status.value)]


def _values(pipeline: CreepPipeline) -> dict[str, str]:
    last = pipeline.last
    numbers = {} if last is None else {"peak": last.status.name, "withheld": str(not last.known).lower()}
    if last is not None:
        items = last._asdict().items()
        numbers |= {name: f"{value:.6g}" for name, value in items if isinstance(value, float)}
    counts = {"samples": str(pipeline.accepted), "resets": str(pipeline.resets)}
    drops = {f"dropped.{reason}": str(count) for reason, count in pipeline.dropped.items()}
    return {**numbers, **counts, **drops, "digest": pipeline.digest}


def _news(pipeline: CreepPipeline) -> tuple[Peak | None, str]:
    """Whether the peak is known."""
    last = pipeline.last
    return (None, "no estimate yet") if last is None else (last.status, f"{last.status.name}: {last.status.value}")


KIND = Kind(
    "creep_estimator", "peak", PARAMETERS, _set_up, topics.CREEP_INPUTS, topics.CREEP_RESULTS, _findings, _values, _news
)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node as a program."""
    return runtime.run("creep_estimator", CreepEstimator, args, PARAMETERS, EXAMPLES)


if __name__ == "__main__":
    sys.exit(main())

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`replay --offline --estimator creep`: a recording straight through the creep identification, without ROS."""

import argparse
import math
import sys
from collections.abc import Mapping
from typing import Any

from ..bag import BagReader
from ..command.checks import refuse
from ..command.options import DONE, FAILED, progress, report
from ..wire.settings.given import given
from ..wire.settings.nodes import CREEP_SETTINGS
from ..wire.settings.setup import creep_setup_of
from ..wire.topics import CREEP_INPUTS
from .creep_pipeline import CreepPipeline
from .offline import feed, messages, much_dropped

NODE = "creep_estimator"

PEAK = ("mu_max", "lambda_m", "mu_max_lower", "mu_max_upper")
CURVE = ("p1", "p2", "p1_std", "p2_std")
"""What is reported of an estimate: only while the peak is told, and always."""


def run(options: argparse.Namespace, reader: BagReader, selection: Mapping[str, str]) -> int:
    """Replay the topics of `selection` (recorded name to ours) and report; the exit code of the tool."""
    refuse(options, ["seed"], "the creep identification draws nothing: leave it out")
    refuse(options, ["train"], "the locomotive of the creep identification is told by --set: leave it out")
    refuse(options, ["out"], "rows are there of the adhesion alone, not of the creep curve: leave it out")
    if lacking := [topic.name for topic in CREEP_INPUTS if topic.name not in selection.values()]:
        raise ValueError(f"bag = {reader.path}: holds no {' and no '.join(lacking)}, without which there is no creep")
    setup = creep_setup_of(given(options, NODE, CREEP_SETTINGS))
    pipeline = CreepPipeline(setup.config)
    recorded = progress(messages(reader, selection, setup.line), "messages")
    for _ in feed(pipeline, recorded, CREEP_INPUTS, setup.line):
        pass
    pipeline.finish()
    for why in much_dropped(pipeline) if pipeline.last is None else ():
        print(f"replay: nothing is identified: {why}", file=sys.stderr)
    result = summary(pipeline)
    report(options.json, result, "\n".join(f"{name:<28} {value}" for name, value in result.items()))
    return FAILED if pipeline.last is None else DONE


def summary(pipeline: CreepPipeline) -> dict[str, Any]:
    """What a replay reports of the last estimate; a peak that is withheld is None, as is what is infinite."""
    result: dict[str, Any] = {"samples": pipeline.accepted, "dropped": pipeline.dropped}
    last = pipeline.last
    if last is not None:
        peak = {name: getattr(last, name) if last.known else None for name in PEAK}
        result |= peak | {name: _finite(getattr(last, name)) for name in CURVE}
        result |= {"peak": last.status.name, "withheld": None if last.known else last.status.value}
    return result | {"digest": pipeline.digest}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None

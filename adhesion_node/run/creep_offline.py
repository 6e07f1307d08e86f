# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`replay --offline --estimator creep`: a recording straight through the creep identification, without ROS."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Mapping
from typing import Any

from ..bag import BagReader
from ..command.options import DONE, FAILED, progress, report
from ..wire import parameter_file
from ..wire.codecs import NOMINAL, Line, Rejected
from ..wire.topics import CREEP_INPUTS, WHEEL_SPEED
from .creep_pipeline import SETTINGS, CreepPipeline, setup_of
from .offline import messages

NODE = "creep_estimator"

PEAK = ("mu_max", "lambda_m", "mu_max_lower", "mu_max_upper")
CURVE = ("p1", "p2", "p1_std", "p2_std")
"""What is reported of an estimate: only while the peak is told, and always."""


def run(options: argparse.Namespace, reader: BagReader, selection: Mapping[str, str]) -> int:
    """Replay the topics of `selection` (recorded name to ours) and report; the exit code of the tool."""
    if options.seed is not None:
        raise ValueError(f"seed = {options.seed}: the creep identification draws nothing, leave it out")
    if WHEEL_SPEED.name not in selection.values():
        raise ValueError(f"bag = {reader.path}: holds no {WHEEL_SPEED.name}, without which there is no creep")
    setup = setup_of(parameter_file.given(options, NODE, SETTINGS))
    pipeline = CreepPipeline(setup.config)
    replay(pipeline, progress(messages(reader, selection), "messages"), setup.line)
    result = summary(pipeline)
    report(options.json, result, "\n".join(f"{name:<28} {value}" for name, value in result.items()))
    return FAILED if pipeline.last is None else DONE


def replay(pipeline: CreepPipeline, recorded: Iterable[tuple[str, Any, int]], line: Line = NOMINAL) -> None:
    """Feed recorded messages, each with our name of its topic and its log time, to the pipeline."""
    inputs = {topic.name: topic for topic in CREEP_INPUTS}
    for name, message, _ in recorded:
        if name in inputs:
            try:
                sample = inputs[name].read(message, line)
            except Rejected as refusal:
                pipeline.refuse(name, refusal.reason)
            else:
                pipeline.push(sample)
    pipeline.finish()


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

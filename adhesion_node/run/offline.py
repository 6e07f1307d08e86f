# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`replay --offline`: a recording straight through the estimator, without ROS."""

import argparse
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..bag import BagReader
from ..command.options import DONE, FAILED, progress, report
from ..core.intake.samples import PressureSample, Sample
from ..core.prediction import Prediction
from ..wire.codecs import NOMINAL, Line, Rejected
from ..wire.settings import SEED, SETTINGS, given, setup_of
from ..wire.topics import ADHESION_INPUTS, FIX, SPEED, TRUTH_MU, TRUTH_STATE, Topic
from .engine import EstimatorPipeline
from .pipeline import Pipeline
from .reader import Reader
from .score import Truth, mean_relative_error_percent

Recorded = tuple[str, Any, int]
"""Our name of a message's topic, the message or why it is refused, its log time in ns."""

Output = TypeVar("Output")


def run(options: argparse.Namespace, reader: BagReader, selection: Mapping[str, str]) -> int:
    """Replay the topics of `selection` (recorded name to ours) and report; the exit code of `replay --offline`."""
    setup, truth = setup_of(parameters_of(options)), Truth()
    anchors = [topic.name for topic in (*Reader(ADHESION_INPUTS, setup.line).anchors, SPEED)]
    if not set(anchors) & set(selection.values()):
        fix = f"; a {FIX.name} needs track_line" if FIX.name in selection.values() else ""
        raise ValueError(
            f"bag = {reader.path}: holds no {' or '.join(anchors)}, without which nothing is identified{fix}"
        )
    pipeline = Pipeline(setup.config, setup.seed)
    replayed = replay(pipeline, truth, progress(messages(reader, selection), "messages"), setup.line)
    result = summary(pipeline, replayed, truth)
    report(options.json, result, "\n".join(f"{name:<28} {value}" for name, value in result.items()))
    return DONE if replayed.predictions else FAILED


def parameters_of(options: argparse.Namespace) -> dict[str, Any]:
    """Settings by name from the options --params, --set and --seed, the later ones over the earlier."""
    values = given(options, "estimator", SETTINGS)
    return values if options.seed is None else {**values, SEED.name: options.seed}


class Replayed(NamedTuple):
    """Result of a replay."""

    predictions: list[Prediction]
    window_ms: list[float]
    """How long each full window took, estimate and curves included."""


def replay(pipeline: Pipeline, truth: Truth, recorded: Iterable[Recorded], line: Line = NOMINAL) -> Replayed:
    """Feed recorded messages to the pipeline, and the simulator's truth to `truth`."""
    replayed = Replayed([], [])
    for sample, predictions, took_s in feed(pipeline, _noting(truth, recorded), ADHESION_INPUTS, line):
        if isinstance(sample, PressureSample):
            truth.pressure_pa[sample.t_ns] = sample.pressure_pa
        if any(prediction.estimate.window >= pipeline.config.window for prediction in predictions):
            replayed.window_ms.append(1e3 * took_s)
        replayed.predictions.extend(predictions)
    replayed.predictions.extend(pipeline.finish())
    return replayed


def feed(
    pipeline: EstimatorPipeline[Any, Any, Output], recorded: Iterable[Recorded], inputs: Sequence[Topic], line: Line
) -> Iterator[tuple[Sample, list[Output], float]]:
    """Push the messages of `inputs`; yield each sample, what it completed and how long that took, s."""
    reader = Reader(inputs, line)
    topics = {topic.name: topic for topic in reader.inputs}
    for name, message, _ in recorded:
        if isinstance(message, Rejected):
            pipeline.refuse(name, message.reason)
        if isinstance(message, Rejected) or name not in topics:
            continue
        try:
            sample = reader.read(topics[name], message)
        except Rejected as refusal:
            pipeline.refuse(name, refusal.reason)
        else:
            started = time.perf_counter()
            outputs = pipeline.push(sample)
            yield sample, outputs, time.perf_counter() - started


def _noting(truth: Truth, recorded: Iterable[Recorded]) -> Iterator[Recorded]:
    """Pass the messages on, and note what the simulator knew."""
    for name, message, log_ns in recorded:
        try:
            if name == TRUTH_MU.name and not isinstance(message, Rejected):
                truth.mu[log_ns] = TRUTH_MU.read(message)
            elif name == TRUTH_STATE.name and not isinstance(message, Rejected):
                state = TRUTH_STATE.read(message)
                truth.speed_mps[state.t_ns] = state.speed_mps
        except Rejected as refusal:
            yield name, refusal, log_ns
        else:
            yield name, message, log_ns


def summary(pipeline: Pipeline, replayed: Replayed, truth: Truth) -> dict[str, Any]:
    """What a replay reports; without any estimate the final values are None."""
    estimates = [prediction.estimate for prediction in replayed.predictions]
    last = estimates[-1] if estimates else None
    result: dict[str, Any] = {
        "measurements": pipeline.measurements,
        "accepted": pipeline.accepted,
        "ticks": pipeline.ticks,
        "dropped": pipeline.dropped,
        "windows": pipeline.windows,
        "mu_final": last and last.mu,
        "mu_lower_final": last and last.mu_lower,
        "regime_final": last and last.regime.name,
        "digest": pipeline.digest,
    }
    error = mean_relative_error_percent(pipeline.config, truth, estimates)
    if error is not None:
        result["mean_relative_error_percent"] = error
    if replayed.window_ms:
        result |= {f"ms_per_window_p{p}": float(np.percentile(replayed.window_ms, p)) for p in (50, 99)}
    return result


def messages(reader: BagReader, selection: Mapping[str, str]) -> Iterator[Recorded]:
    """Yield the recorded messages of `selection` under our names; one that does not decode as refused."""
    for record in reader.messages(selection):
        try:
            message = record.message
        except Rejected as refusal:
            message = refusal
        yield selection[record.topic], message, record.log_ns

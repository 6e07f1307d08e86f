# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`replay --offline`: a recording straight through the estimator, without ROS."""

import argparse
import sys
import time
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..bag import BagReader, Record
from ..bag.read.together import read_together
from ..bag.read.turns import in_turn
from ..command.options import DONE, FAILED, progress, report
from ..core import Outcome
from ..core.intake.samples import PressureSample, Sample
from ..core.prediction import Prediction
from ..wire.line import NOMINAL, Line
from ..wire.messages.refused import Reason, Rejected
from ..wire.settings.given import given
from ..wire.settings.nodes import SEED, SETTINGS
from ..wire.settings.setup import setup_of
from ..wire.topic import Topic
from ..wire.topics import ADHESION_INPUTS, FIX, SENSORS, SPEED, TRUTH_LIMITED, TRUTH_MU, TRUTH_STATE, WHEEL_SPEED
from .engine import EstimatorPipeline
from .pipeline import BACK_M, BACKWARDS, Pipeline
from .reader import Reader
from .results.brake import odd_brake
from .results.rows import row_of, rows_to
from .results.score import Identified, Point, Truth, mean_relative_error_percent
from .results.seen import MANY, Seen

Recorded = tuple[str, Any, int]
"""Our name of a message's topic; the message, what was read of it, or why it is refused; its log time in ns."""

Output = TypeVar("Output")


def run(options: argparse.Namespace, reader: BagReader, selection: Mapping[str, str]) -> int:
    """Replay the topics of `selection` (recorded name to ours) and report; the exit code of `replay --offline`."""
    setup = setup_of(parameters_of(options))
    anchors = [topic.name for topic in (*Reader(ADHESION_INPUTS, setup.line).anchors, SPEED, WHEEL_SPEED)]
    if not set(anchors) & set(selection.values()):
        fix = f"; a {FIX.name} needs track_line" if FIX.name in selection.values() else ""
        raise ValueError(
            f"bag = {reader.path}: holds no {' or '.join(anchors)}, without which nothing is identified{fix}"
        )
    pipeline, window_ms = Pipeline(setup.config, setup.seed), array("d")
    truth = Truth() if TRUTH_MU.name in selection.values() else None
    recorded = progress(messages(reader, selection, setup.line), "messages")
    compared: list[Point] = []
    seen = Seen(setup.config.train.full_pressure_pa)
    with rows_to(options.out) as write:
        # nothing is kept of an estimate but what is compared with the truth: a day takes no more memory than an hour
        for made in predictions(pipeline, truth, recorded, setup.line, window_ms):
            write(row_of(pipeline, made, setup.line.sign))
            e = made.estimate
            seen.follow(pipeline, e)
            if truth is not None:
                compared.append(Point(made.estimate.t_ns, made.estimate.mu))
    result = {"train": setup.train, **summary(pipeline, window_ms, truth, compared)}
    if options.out:
        result["out"] = options.out
    if pipeline.back_m > BACK_M:
        result["back_m"] = pipeline.back_m
    brake = odd_brake(seen, pipeline)
    why = seen.why_not(brake)
    if why is not None:
        result["why"] = why
    for remark in (*setup.unread, *remarks(pipeline, why, brake)):
        print(f"replay: {remark}", file=sys.stderr)
    report(options.json, result, "\n".join(f"{name:<28} {value}" for name, value in result.items()))
    return DONE if seen.identified else FAILED


def remarks(pipeline: Pipeline, why: str | None = None, brake: str | None = None) -> Iterator[str]:
    """What a person must hear: nothing is identified, much was dropped, its brake, its way, or a map to come."""
    yield from much_dropped(pipeline)
    if why is not None:
        yield f"nothing is identified: {why}"
    elif pipeline.back_m > BACK_M:
        yield BACKWARDS
    if brake is not None and brake != why:
        yield brake
    yield from filter(None, (pipeline.off_track, pipeline.turned))
    rail_map, last = pipeline.config.rail_map, pipeline.last
    first_ns = min((piece.t_ns for piece in rail_map.pieces), default=None) if rail_map else None
    if first_ns is not None and last is not None and first_ns > last.t_ns:
        late = f"rail_map begins at t_ns = {first_ns}, this recording ends at {last.t_ns}"
        yield f"{late}: no train is less careful by what later ones saw: name a map of earlier ones"


def much_dropped(pipeline: EstimatorPipeline[Any, Any, Any]) -> Iterator[str]:
    """Why so many messages were not used that it matters."""
    for reason, count in pipeline.dropped.items():
        is_line = reason == Reason.NO_TRACK_LINE.name  # that is no fault now and then: it is all fixes
        if is_line or count > MANY * pipeline.measurements:
            known = Outcome[reason].value if reason in Outcome.__members__ else pipeline.refused.get(reason)
            what = "fixes" if is_line else "messages"
            yield f"{count} {what} were dropped: {reason}" + (f": {known}" if known else "")


def parameters_of(options: argparse.Namespace) -> dict[str, Any]:
    """Settings by name from the options --params, --set and --seed, the later ones over the earlier."""
    values = given(options, "estimator", SETTINGS)
    return values if options.seed is None else {**values, SEED.name: options.seed}


class Replayed(NamedTuple):
    """Result of a replay."""

    predictions: list[Prediction]
    window_ms: Sequence[float]
    """How long each full window took, estimate and curves included."""


def replay(pipeline: Pipeline, truth: Truth, recorded: Iterable[Recorded], line: Line = NOMINAL) -> Replayed:
    """Feed recorded messages to the pipeline, and the simulator's truth to `truth`; keep all that comes out."""
    window_ms = array("d")
    return Replayed(list(predictions(pipeline, truth, recorded, line, window_ms)), window_ms)


def predictions(
    pipeline: Pipeline, truth: Truth | None, recorded: Iterable[Recorded], line: Line, window_ms: "array[float]"
) -> Iterator[Prediction]:
    """Yield what recorded messages give as soon as it is there; note the truth, if asked for, and times of windows."""
    noted = recorded if truth is None else _noting(truth, recorded)
    for sample, outputs, took_s in feed(pipeline, noted, ADHESION_INPUTS, line):
        if truth is not None and isinstance(sample, PressureSample):
            truth.pressure_pa[sample.t_ns] = sample.pressure_pa
        if outputs:
            if any(prediction.estimate.window >= pipeline.config.window for prediction in outputs):
                window_ms.append(1e3 * took_s)
            yield from outputs
    yield from pipeline.finish()


def feed(
    pipeline: EstimatorPipeline[Any, Any, Output], recorded: Iterable[Recorded], inputs: Sequence[Topic], line: Line
) -> Iterator[tuple[Sample, list[Output], float]]:
    """Push the messages of `inputs`; yield each sample, what it completed and how long that took, s."""
    reader = Reader(inputs, line)
    topics = {topic.name: topic for topic in reader.inputs}
    if line.position_source == "auto" and FIX in inputs:
        topics[FIX.name] = FIX  # without a track line it is none of the reader's: refused, it is counted, and told
    for name, message, _ in recorded:
        if isinstance(message, Rejected):
            pipeline.refuse(name, message.reason, str(message))
            continue
        topic = topics.get(name)
        if topic is None:
            continue
        try:
            sample = reader.read(topic, message)
        except Rejected as refusal:
            pipeline.refuse(name, refusal.reason, str(refusal))
        else:
            started = time.perf_counter()
            outputs = pipeline.push(sample)
            yield sample, outputs, time.perf_counter() - started


def _noting(truth: Truth, recorded: Iterable[Recorded]) -> Iterator[Recorded]:
    """Pass the messages on, and note what the simulator knew."""
    for name, message, log_ns in recorded:
        try:
            if isinstance(message, Rejected):
                pass
            elif name == TRUTH_MU.name:
                truth.mu[log_ns] = TRUTH_MU.read(message)
            elif name == TRUTH_LIMITED.name:
                truth.limited[log_ns] = TRUTH_LIMITED.read(message)
            elif name == TRUTH_STATE.name:
                state = TRUTH_STATE.read(message)
                truth.speed_mps[state.t_ns] = state.speed_mps
        except Rejected as refusal:
            yield name, refusal, log_ns
        else:
            yield name, message, log_ns


def summary(
    pipeline: Pipeline, window_ms: Sequence[float], truth: Truth | None, estimates: Iterable[Identified]
) -> dict[str, Any]:
    """What a replay reports; without any estimate the final values are None, without truth there is no error."""
    last = pipeline.last
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
    error = truth and mean_relative_error_percent(pipeline.config, truth, estimates)
    if error is not None:
        result["mean_relative_error_percent"] = error
    if window_ms:
        result |= {f"ms_per_window_p{p}": float(np.percentile(window_ms, p)) for p in (50, 99)}
    return result


def messages(reader: BagReader, selection: Mapping[str, str], line: Line) -> Iterator[Recorded]:
    """Yield the recorded messages of `selection` under our names; one that does not decode as refused.

    Of a sensor's messages that can be read together it is their samples.
    """
    sensors = {theirs: topic for theirs, ours in selection.items() for topic in SENSORS if topic.name == ours}
    for record, sample in read_together(in_turn(reader.messages(selection)), sensors, line):
        yield selection[record.topic], _message(record) if sample is None else sample, record.log_ns


def _message(record: Record) -> Any:
    try:
        return record.message
    except Rejected as refusal:
        return refusal

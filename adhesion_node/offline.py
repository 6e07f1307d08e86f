"""`replay --offline`: a recording straight through the estimator, without ROS."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from . import reading
from .bag import BagReader
from .cli import DONE, FAILED, progress, report
from .core.align import PressureSample, Sample
from .core.prediction import Prediction
from .pipeline import Pipeline
from .score import Truth, mean_relative_error_percent
from .settings import SEED, parse_setting, setup_of
from .topics import BRAKE_PRESSURE, FRAME, POSITION, SPEED, TRUTH_MU, TRUTH_STATE

READERS: dict[str, Callable[[Any, str], Sample]] = {
    POSITION.name: reading.position,
    BRAKE_PRESSURE.name: reading.brake_pressure,
    SPEED.name: reading.speed,
}
"""How the messages of a sensor topic become samples."""


def run(options: argparse.Namespace, reader: BagReader, selection: Mapping[str, str]) -> int:
    """Replay the topics of `selection` (recorded name to ours) and report; the exit code of `replay --offline`."""
    values = _read_parameters(options.params) if options.params else {}
    values |= dict(map(parse_setting, options.set))
    if options.seed is not None:
        values[SEED.name] = options.seed
    setup, truth = setup_of(values), Truth()
    pipeline = Pipeline(setup.config, setup.seed)
    predictions = replay(pipeline, truth, progress(messages(reader, selection), "messages"), setup.frame)
    result = summary(pipeline, predictions, truth)
    report(options.json, result, "\n".join(f"{name:<28} {value}" for name, value in result.items()))
    return DONE if predictions else FAILED


def replay(
    pipeline: Pipeline, truth: Truth, recorded: Iterable[tuple[str, Any, int]], frame: str = FRAME
) -> list[Prediction]:
    """Feed recorded messages to the pipeline, and the simulator's truth to `truth`.

    A message comes with our name of its topic and its log time in ns; sensor messages must be in `frame`.
    """
    predictions = []
    for name, message, log_ns in recorded:
        if name in READERS:
            try:
                sample = READERS[name](message, frame)
            except reading.Rejected as error:
                pipeline.refuse(error.reason)
            else:
                predictions += pipeline.push(sample)
                if isinstance(sample, PressureSample):
                    truth.pressure_pa[sample.t_ns] = sample.pressure_pa
        elif name == TRUTH_MU.name:
            truth.mu[log_ns] = float(message.data)
        elif name == TRUTH_STATE.name:
            truth.speed_mps[reading.stamp_ns(message.header)] = float(message.twist.twist.linear.x)
    return predictions + pipeline.finish()


def summary(pipeline: Pipeline, predictions: list[Prediction], truth: Truth) -> dict[str, Any]:
    """What a replay reports; without any estimate the final values are None."""
    last = predictions[-1].estimate if predictions else None
    result = {
        "measurements": pipeline.received,
        "accepted": pipeline.accepted,
        "dropped": pipeline.dropped,
        "windows": pipeline.windows,
        "mu_final": last and last.mu,
        "mu_lower_final": last and last.mu_lower,
        "regime_final": last and last.regime.name,
        "digest": pipeline.digest,
    }
    error = mean_relative_error_percent(pipeline.config, truth, [prediction.estimate for prediction in predictions])
    return result if error is None else {**result, "mean_relative_error_percent": error}


def messages(reader: BagReader, selection: Mapping[str, str]) -> Iterator[tuple[str, Any, int]]:
    """Yield the recorded messages of `selection` under our names."""
    for record in reader.messages(selection):
        yield selection[record.topic], record.message, record.log_ns


def _read_parameters(path: str) -> dict[str, Any]:
    """Settings of the estimator in a ROS parameter file; ValueError when it is unreadable or not for the estimator."""
    try:
        document = YAML(typ="safe").load(Path(path).read_text(encoding="utf-8"))
        nodes = {name.strip("/"): content["ros__parameters"] for name, content in document.items()}
    except (OSError, UnicodeDecodeError, YAMLError, AttributeError, LookupError, TypeError) as error:
        raise ValueError(f"params = {path}: not a readable ROS parameter file ({type(error).__name__})") from error
    if "estimator" not in nodes and "**" not in nodes:
        raise ValueError(f"params = {path}: has {', '.join(nodes)}: name the node 'estimator' or '/**'")
    return {**nodes.get("**", {}), **nodes.get("estimator", {})}

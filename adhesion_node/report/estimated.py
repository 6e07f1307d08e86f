# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The run of a recording that holds sensor messages alone: what the estimator makes of them, offline."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..bag import BagReader
from ..command.options import progress
from ..core.physics.braking import BrakingCurve
from ..core.prediction import Prediction
from ..run import offline
from ..run.pipeline import Pipeline
from ..run.score import Truth
from ..wire.settings import Setup
from ..wire.topics import BRAKE_PRESSURE, TRUTH_MU, TRUTH_STATE, Topic
from .run import Curve, Run, position_of, speed_of
from .series import Series, read_series


def estimate_run(reader: BagReader, selection: Mapping[str, str], setup: Setup) -> Run:
    """Run the recorded topics of `selection` (recorded name to ours) through the estimator.

    Raises ValueError when nothing could be estimated.
    """
    pipeline = Pipeline(setup.config, setup.seed)
    recorded = progress(offline.messages(reader, selection), "messages")
    predictions = offline.replay(pipeline, Truth(), recorded, setup.line).predictions
    if not predictions:
        dropped = ", ".join(f"{count} {reason}" for reason, count in pipeline.dropped.items()) or "nothing"
        raise ValueError(f"bag = {reader.path}: nothing to estimate from; dropped of its sensor messages: {dropped}")
    sources = {ours: recorded for recorded, ours in selection.items()}

    def series(topic: Topic, value: Any) -> Series:
        return read_series(reader, topic._replace(name=sources.get(topic.name, topic.name)), value)

    return Run(
        true_mu=series(TRUTH_MU, lambda message: message.data),
        true_position=series(TRUTH_STATE, position_of),
        true_speed=series(TRUTH_STATE, speed_of),
        pressure=series(BRAKE_PRESSURE, lambda message: message.fluid_pressure),
        mu=_column(predictions, "mu"),
        mu_lower=_column(predictions, "mu_lower"),
        position=_column(predictions, "position_m"),
        speed=_column(predictions, "speed_mps"),
        regime=_series(predictions, [prediction.estimate.regime.name for prediction in predictions]),
        safe=_curves(predictions, [prediction.safe for prediction in predictions]),
        nominal=_curves(predictions, [prediction.nominal for prediction in predictions]),
        remarks=_series(predictions[:0], []),
        levels=_series(predictions[:0], []),
        counts=_counts(pipeline),
    )


def _column(predictions: list[Prediction], name: str) -> Series:
    return _series(predictions, [getattr(prediction.estimate, name) for prediction in predictions])


def _series(predictions: list[Prediction], values: list[Any]) -> Series:
    return Series(np.array([prediction.estimate.t_ns for prediction in predictions], dtype=np.int64), np.array(values))


def _curves(predictions: list[Prediction], curves: list[BrakingCurve | None]) -> tuple[Curve, ...]:
    return tuple(
        Curve(prediction.estimate.t_ns, prediction.estimate.position_m + curve.distance_m, curve.speed_mps)
        for prediction, curve in zip(predictions, curves, strict=True)
        if curve is not None
    )


def _counts(pipeline: Pipeline) -> dict[str, str]:
    """The counts under the keys that they have in the diagnostics."""
    return {
        "measurements": str(pipeline.measurements),
        "accepted": str(pipeline.accepted),
        "windows": str(pipeline.windows),
        **{f"dropped.{reason}": str(count) for reason, count in pipeline.dropped.items()},
        "confidence": f"{pipeline.config.confidence:g}",
        "digest": pipeline.digest,
    }

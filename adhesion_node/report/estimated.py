# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The run of a recording that holds sensor messages alone: what the estimator makes of them, offline."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..bag import BagReader
from ..command.options import progress
from ..core import Estimate
from ..core.physics.braking import BrakingCurve
from ..run import offline
from ..run.pipeline import Pipeline
from ..run.score import Truth
from ..wire.settings import Setup
from .findings import listed
from .run import Curve, Run, read_inputs
from .series import Series


def estimate_run(reader: BagReader, selection: Mapping[str, str], setup: Setup) -> Run:
    """Run the recorded topics of `selection` (recorded name to ours) through the estimator.

    Raises ValueError when nothing could be estimated.
    """
    pipeline = Pipeline(setup.config, setup.seed)
    recorded = progress(offline.messages(reader, selection), "messages")
    predictions = offline.replay(pipeline, Truth(), recorded, setup.line).predictions
    if not predictions:
        dropped = listed(pipeline.dropped) or "nothing"
        raise ValueError(f"bag = {reader.path}: nothing to estimate from; dropped of its sensor messages: {dropped}")
    t_ns = np.array([prediction.estimate.t_ns for prediction in predictions], dtype=np.int64)

    def column(value: Callable[[Estimate], Any]) -> Series:
        return Series(t_ns, np.array([value(prediction.estimate) for prediction in predictions]))

    return read_inputs(reader, {ours: recorded for recorded, ours in selection.items()}, setup.line)._replace(
        mu=column(lambda estimate: estimate.mu),
        mu_lower=column(lambda estimate: estimate.mu_lower),
        position=column(lambda estimate: estimate.position_m),
        speed=column(lambda estimate: estimate.speed_mps),
        regime=column(lambda estimate: estimate.regime.name),
        safe=tuple(_curve(made.estimate, made.safe) for made in predictions if made.safe is not None),
        nominal=tuple(_curve(made.estimate, made.nominal) for made in predictions if made.nominal is not None),
        changes=column(lambda estimate: str(estimate.changes)),
        counts={  # under the keys that they have in the diagnostics
            "measurements": str(pipeline.measurements),
            "accepted": str(pipeline.accepted),
            "windows": str(pipeline.windows),
            **{f"dropped.{reason}": str(count) for reason, count in pipeline.dropped.items()},
            "confidence": f"{pipeline.config.confidence:g}",
            "digest": pipeline.digest,
        },
    )


def _curve(estimate: Estimate, curve: BrakingCurve) -> Curve:
    return Curve(estimate.t_ns, estimate.position_m + curve.distance_m, curve.speed_mps)

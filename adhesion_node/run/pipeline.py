# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The way of a sample to an estimate of the adhesion with its braking curves, the same live and offline."""

import struct
from functools import partial
from typing import final

from ..core import Config, Estimate, Outcome, Prediction, State, estimator, predict
from ..core.physics.braking import BrakingCurve
from ..wire.topics import POSITIONS
from .engine import EstimatorPipeline, Verbs


@final
class Pipeline(EstimatorPipeline[State, Estimate, Prediction]):
    """From samples to estimates of the adhesion with their braking curves.

    Raises ValueError for a negative seed.
    """

    anchors = POSITIONS

    def __init__(self, config: Config, seed: int) -> None:
        verbs = (estimator.advance, estimator.settle, estimator.finish)
        super().__init__(Verbs(partial(estimator.init, config, seed), *(partial(verb, config) for verb in verbs)))
        self.config = config
        self.windows = 0

    def _output(self, estimate: Estimate) -> Prediction:
        self.windows += estimate.window > 0
        return predict(self.config, estimate)

    @property
    def ticks(self) -> int:
        """Times without a position at which the other sensors were used."""
        return self._counts()[Outcome.TICK.name]

    @property
    def tally(self) -> str:
        """How much has come and what was made of it, in words."""
        return f"{self.measurements} measurements, {self.windows} windows"

    def stamp_ns(self, output: Prediction) -> int:
        """When it was so."""
        return output.estimate.t_ns

    def _bytes(self, output: Prediction) -> bytes:
        return _prediction_bytes(output)


def _prediction_bytes(prediction: Prediction) -> bytes:
    """Every number of a prediction, little-endian: integers as 8 bytes, floats as doubles."""
    e = prediction.estimate
    whole = struct.pack("<5q", e.t_ns, e.window, e.iterations, e.converged, e.changes)
    real = struct.pack(
        "<9d",
        *(e.mu, e.mu_std, e.mu_lower, e.position_m, e.speed_mps, e.position_std_m, e.speed_std_mps),
        *(e.log_likelihood, e.ess),
    )
    return b"".join(
        [whole, e.regime.name.encode(), real, _curve_bytes(prediction.safe), _curve_bytes(prediction.nominal)]
    )


def _curve_bytes(curve: BrakingCurve | None) -> bytes:
    """The columns of a curve behind its number of points: 0 for none, so that it shows which one is missing."""
    if curve is None:
        return struct.pack("<q", 0)
    columns = (curve.distance_m, curve.speed_mps, curve.deceleration_mps2, curve.time_s)
    return struct.pack("<q", curve.speed_mps.size) + b"".join(column.astype("<f8").tobytes() for column in columns)

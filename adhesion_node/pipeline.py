"""The way of a sample through the estimator, the same for the live node and the offline replay."""

from __future__ import annotations

import hashlib
import struct
from collections import Counter
from collections.abc import Iterable

from .core import Config, Estimate, Measurement, Outcome, finish, init, step
from .core.align import Aligner, PositionSample, Sample
from .core.braking import BrakingCurve
from .core.prediction import Prediction, predict
from .topics import POSITION


class Pipeline:
    """Pairs samples, steps the estimator and predicts; counts what is dropped and digests what comes out.

    Mutable, as the aligner in it: the one stateful thing around the pure core.
    """

    def __init__(self, config: Config, seed: int) -> None:
        self.config = config
        self.state = init(config, seed)
        self.measurements = 0
        """Positions received, whatever became of them."""
        self.refused: Counter[str] = Counter()
        self.windows = 0
        self.last: Estimate | None = None
        self._aligner = Aligner(config.pressure_wait_s, config.pressure_age_s)
        self._digest = hashlib.sha256()

    def push(self, sample: Sample) -> list[Prediction]:
        """Take one sample of any stream and return what it completes."""
        self.measurements += isinstance(sample, PositionSample)
        return self._run(self._aligner.push(sample))

    def refuse(self, topic: str, reason: str) -> None:
        """Count a message of a topic that never became a sample."""
        self.measurements += topic == POSITION.name
        self.refused[reason] += 1

    def finish(self) -> list[Prediction]:
        """End of the data: use what still waits; call once."""
        predictions = self._run(self._aligner.flush())
        self.state, estimates = finish(self.config, self.state)
        return predictions + self._published(estimates)

    @property
    def accepted(self) -> int:
        """Measurements that the estimator used."""
        return self.state.counts[Outcome.ACCEPTED]

    @property
    def dropped(self) -> dict[str, int]:
        """Numbers of messages of any sensor that were not used, by reason; only reasons that occurred."""
        drops = (Outcome.LATE, Outcome.DUPLICATE, Outcome.INVALID, Outcome.OUTLIER)
        counts = self.refused + Counter({outcome.name: self.state.counts[outcome] for outcome in drops})
        return {reason: count for reason, count in sorted(counts.items()) if count}

    @property
    def digest(self) -> str:
        """SHA-256 over every number published so far."""
        return self._digest.hexdigest()

    def _run(self, measurements: Iterable[Measurement]) -> list[Prediction]:
        predictions = []
        for measurement in measurements:
            self.state, estimate = step(self.config, self.state, measurement)
            if estimate is not None:
                predictions += self._published([estimate])
        return predictions

    def _published(self, estimates: Iterable[Estimate]) -> list[Prediction]:
        predictions = [predict(self.config, estimate) for estimate in estimates]
        for prediction in predictions:
            self.windows += prediction.estimate.window > 0
            self.last = prediction.estimate
            self._digest.update(_bytes(prediction))
        return predictions


def _bytes(prediction: Prediction) -> bytes:
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

# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The way of a sample through the estimator, the same for the live node and the offline replay."""

from __future__ import annotations

import hashlib
import struct
from collections import Counter
from collections.abc import Iterable

from ..core import Config, Estimate, Measurement, Outcome, finish, init, step
from ..core.intake.inbox import Aligner, PositionSample, Sample
from ..core.physics.braking import BrakingCurve
from ..core.prediction import Prediction, predict
from ..wire.codecs import Rejected
from ..wire.topics import POSITION
from .guard import Guard


class Pipeline:
    """Pairs samples, steps the estimator and predicts; counts what is dropped and digests what comes out.

    Mutable, as the aligner in it: the one stateful thing around the pure core.
    """

    def __init__(self, config: Config, seed: int) -> None:
        self.config = config
        self._seed = seed
        self.state = init(config, seed)
        self.measurements = 0
        """Positions received, whatever became of them."""
        self.refused: Counter[str] = Counter()
        self.windows = 0
        self.last: Estimate | None = None
        self.refusal: Rejected | None = None
        """Why the sample that came last was not used."""
        self._digest = hashlib.sha256()
        self._begin()

    def _begin(self) -> None:
        self._aligner = Aligner(self.config.pressure_wait_s, self.config.pressure_age_s)
        self._guard = Guard()
        self._seen: Estimate | None = None
        """The last estimate that positions have borne out."""
        self._blind = 0
        self._late: list[int] = []

    def push(self, sample: Sample) -> list[Prediction]:
        """Take one sample of any stream and return what it completes."""
        self.measurements += isinstance(sample, PositionSample)
        self.refusal = self._guard.refusal(sample, self._seen)
        if self.refusal is None:
            return self._run(self._aligner.push(sample))
        self.refused[self.refusal.reason] += 1
        return self._without_sight(sample.t_ns) if self.stuck and isinstance(sample, PositionSample) else []

    @property
    def stuck(self) -> bool:
        """Whether the position sensor repeats itself while the train moves."""
        return self._guard.stuck

    def reset(self) -> list[Prediction]:
        """End the data so far as `finish` does and start anew: only the counts and the digest go on."""
        predictions = self.finish()
        counts = {**self.state.counts, Outcome.RESET: self.state.counts[Outcome.RESET] + 1}
        self.state = init(self.config, self._seed)._replace(counts=counts, method=self.state.method)
        self._begin()
        return predictions

    def refuse(self, topic: str, reason: str) -> None:
        """Count a message of a topic that is not used."""
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
            if self._went_back(measurement.t_ns):
                predictions += self.reset()
        return predictions

    def _went_back(self, t_ns: int) -> bool:
        """Whether so many measurements in a row were late that it must be the time that has gone back.

        Less than `reset_s`, that is, as in a short recording played in a loop; the core sees to the longer jumps.
        """
        late = self.state.outcome is Outcome.LATE
        self._late = [*(self._late if self._late and t_ns > self._late[-1] else []), t_ns] if late else []
        return len(self._late) >= self.config.max_outliers

    def _without_sight(self, t_ns: int) -> list[Prediction]:
        """As often as there are estimates, say what holds while the position sensor is stuck."""
        self._blind += 1
        due = (self._blind - 1) % self.config.step == 0
        prediction = self._guard.blind(self.config, t_ns) if due else None
        return [] if prediction is None else self._digested([prediction])

    def _published(self, estimates: Iterable[Estimate]) -> list[Prediction]:
        return self._digested([predict(self.config, estimate) for estimate in estimates])

    def _digested(self, predictions: list[Prediction]) -> list[Prediction]:
        for prediction in predictions:
            self.windows += prediction.estimate.window > 0
            self.last = prediction.estimate
            self._seen = self._seen if prediction.withheld else self.last
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

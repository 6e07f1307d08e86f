# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The way of a sample to an estimate of the adhesion with its braking curves, the same live and offline."""

import math
import struct
from collections import Counter
from functools import partial
from typing import final

from ..core import Config, Estimate, Outcome, Prediction, Sample, State, WheelSample, estimator, predict
from ..core.physics.braking import BrakingCurve
from ..core.physics.track import Track
from ..wire.topics import POSITIONS
from .engine import EstimatorPipeline, Verbs
from .turned import TURNS_RADPS, turned

BACK_MPS, BACK_M = 3.0, 10.0
"""A train that runs back faster and further than this does not roll back: its positions fall along the run."""

SURE_SIGMA = 2.0
"""Standard deviations by which it surely does: one that nothing is heard of may be foreseen to run back."""

BACKWARDS = (
    "positions fall while the train runs: set direction to what the chainage does along the run, up where it rises, "
    "down where it falls; or change their sign, or that of a speed, which counts forward along the run"
)


def off_track(track: Track, least_m: float, most_m: float) -> str | None:
    """Say that no section of the track is where the train ran, as the run counts positions; None where one is."""
    off_m = track.off(least_m, most_m)
    where = f"the nearest is {abs(off_m):.0f} m {'ahead of' if off_m > 0.0 else 'behind'} it"
    remedy = "is the track's chainage, direction or unit another? All that the train ran on counts as level"
    return f"no section of the track is where the train ran: {where}: {remedy}" if off_m else None


@final
class Pipeline(EstimatorPipeline[State, Estimate, Prediction]):
    """From samples to estimates of the adhesion with their braking curves.

    Raises ValueError for a negative seed.
    """

    anchors = POSITIONS
    config: Config

    def __init__(self, config: Config, seed: int) -> None:
        verbs = (estimator.advance, estimator.settle, estimator.finish)
        super().__init__(Verbs(partial(estimator.init, config, seed), *(partial(verb, config) for verb in verbs)))
        self.config = config
        self.windows = 0
        self._back_from_m: float | None = None
        """Where it began to run back."""
        self.back_m = 0.0
        """How far it has run back at most, without a break, faster than `BACK_MPS`."""
        self._doubts = 0
        """Positions that were doubted, and new beginnings."""
        self.is_shown = True
        """Whether what the newest estimate says of the train's direction was measured, not only foreseen."""
        self._ran_m = (math.inf, -math.inf)
        self._turns = Counter[str]()
        """How often an axle turned forward, less how often back."""

    def push(self, sample: Sample) -> list[Prediction]:
        """Take one sample of any sensor and return what it completes."""
        if isinstance(sample, WheelSample):
            for axle, radps in enumerate(sample.speeds_radps, 1):
                self._turns[f"axle {axle}"] += (radps > TURNS_RADPS) - (radps < -TURNS_RADPS)
        return super().push(sample)

    def adopt(self, other: EstimatorPipeline[State, Estimate, Prediction]) -> None:
        """Go on with what another one is configured with; a latency may be another, and stamps step as is meant."""
        super().adopt(other)
        self.state = self.state._replace(clock=self.state.clock.unsure())

    def _output(self, estimate: Estimate) -> Prediction:
        self.windows += estimate.window > 0
        self._note_way(estimate)
        return predict(self.config, estimate)

    @property
    def runs_back(self) -> bool:
        """Whether the train, by its positions, runs back at speed."""
        return self.last is not None and self._back_m(self.last) > BACK_M

    def _note_way(self, estimate: Estimate) -> None:
        self.is_shown = self._shows()
        if not self.is_shown or estimate.speed_mps + SURE_SIGMA * estimate.speed_std_mps > -BACK_MPS:
            self._back_from_m = None
        elif self._back_from_m is None or estimate.position_m > self._back_from_m:
            self._back_from_m = estimate.position_m
        self.back_m = max(self.back_m, self._back_m(estimate))
        self._ran_m = min(self._ran_m[0], estimate.position_m), max(self._ran_m[1], estimate.position_m)

    def _shows(self) -> bool:
        """Whether what came since the estimate before shows where the train runs to.

        It does unless positions were doubted, and always by a speed below 0.
        """
        doubts = sum(self.state.counts.get(outcome, 0) for outcome in (Outcome.OUTLIER, Outcome.STUCK, Outcome.RESET))
        doubts, self._doubts = doubts - self._doubts, doubts
        newest = self.state.newest
        return not doubts or (newest is not None and (newest.speed_mps or 0.0) < 0.0)

    @property
    def off_track(self) -> str | None:
        """Why the track cannot be that of this run; None where it can."""
        return None if self.last is None else off_track(self.config.track, *self._ran_m)

    @property
    def turned(self) -> str | None:
        """Which axles are counted backwards, unless the train itself ran back; None: none is."""
        return None if self.back_m > BACK_M else turned(self._turns)

    def _back_m(self, estimate: Estimate) -> float:
        return 0.0 if self._back_from_m is None else self._back_from_m - estimate.position_m

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
    numbers = [column.astype("<f8", copy=False).tobytes() for column in columns]
    return b"".join([struct.pack("<q", curve.speed_mps.size), *numbers])

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Braking distances at every estimate of a run: by the fixed worst case, by the curves, and as the train truly went."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...core.physics import braking
from ...core.physics.train import Array, Train
from ..read.predicted import Curves
from ..read.run import Run
from ..read.series import NONE, Series
from .brakings import RELEASED_NS, brakings

FIXED_MU = 0.0726
"""The worst case by which trains brake where the adhesion is not known (Xie et al. 2019)."""

MOST_SPEEDS = 2000
"""Curves on one adhesion are integrated at so many speeds at most, and interpolated between: to 1 mm at 100 m/s."""


class Distances(NamedTuple):
    """Braking distances, m, at every estimate; arrays of the estimates' shape."""

    fixed: Array
    """By the fixed worst case, on a level track."""
    identified: Array
    """By the nominal curves."""
    longest: Array
    """By the safe curves: exceeded once in 1 / (1 − `curve_confidence`)."""

    @property
    def saved(self) -> Array:
        """Saved by the identified adhesion against the fixed one; negative where it is lower."""
        return self.fixed - self.identified

    @property
    def saved_at_least(self) -> Array:
        """Saved at least, by the safe curves."""
        return self.fixed - self.longest


@lru_cache
def distances(run: Run, target_mps: float, train: Train) -> Distances:
    """Braking distances from the speed at each estimate to the target speed."""
    times = run.speed.t_ns
    return Distances(
        fixed=distance_to_target(run, FIXED_MU, target_mps, train),
        identified=distance_to_target(run, run.mu.at(times), target_mps, train, run.nominal),
        longest=distance_to_target(run, run.mu_lower.at(times), target_mps, train, run.safe),
    )


@lru_cache
def true_way(run: Run, target_mps: float) -> Series:
    """Way, m, that the train truly went from each moment of a braking until it had the target speed.

    Empty where the recording holds no truth or brake pressure, or the train never got there.
    """
    t_ns, place = run.true_position
    slow = run.true_speed.values <= target_mps
    if not (slow.any() and run.pressure.t_ns.size):
        return NONE
    parts = []
    for part in brakings(run):
        begun = np.flatnonzero(t_ns >= part.start_ns)
        reached = begun[slow[begun]]
        if reached.size and t_ns[reached[0]] <= part.end_ns + RELEASED_NS:
            during = begun[begun <= reached[0]]
            parts.append((t_ns[during], np.abs(place[reached[0]] - place[during])))
    return Series(*(np.concatenate(column) for column in zip(*parts, strict=True))) if parts else NONE


def distance_to_target(
    run: Run, mu: Array | float, target_mps: float, train: Train, curves: Curves | None = None
) -> Array:
    """Braking distance, m, from the speed at each estimate to the target speed; 0 below it.

    By the one of `curves` that has the estimate's stamp. Where there is none, adhesion stays at its present value `mu`
    on a level track; a bound below 0 counts as no adhesion.
    """
    found = (curves or Curves()).lengths(target_mps).exactly(run.speed.t_ns)
    speeds, (held, _) = np.abs(run.speed.values), np.broadcast_arrays(np.maximum(mu, 0.0), found)
    without = np.isnan(found)
    if np.ndim(mu) == 0 and without.sum() > MOST_SPEEDS:
        grid = np.linspace(0.0, speeds.max(), MOST_SPEEDS)
        lengths = [braking.curve(train, v, float(held[0]), target_mps).distance_m[-1] for v in grid.tolist()]
        return np.where(without, np.interp(speeds, grid, lengths), found)
    found[without] = [
        braking.curve(train, v, one, target_mps).distance_m[-1]
        for v, one in zip(speeds[without].tolist(), held[without].tolist(), strict=True)
    ]
    return found

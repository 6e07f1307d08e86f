# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What one braking of a run shows: its row, as a report lists it."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core import Regime
from ...core.physics.train import KMH
from ...run.results.score import CONVERGED_AFTER_MPS
from ...run.results.used import averaged
from ..read.run import Run
from ..read.series import Series
from .brakings import Braking, rises
from .distances import Distances


@lru_cache
def true_used(run: Run) -> Series:
    """The true adhesion over a second, as estimates are held against it."""
    return run.true_mu._replace(values=averaged(*run.true_mu))


def bound_kept(run: Run, first: int, last: int) -> NDArray[np.bool_]:
    """Whether the bound was no higher than the true adhesion over a second, where these estimates have both."""
    times = run.speed.t_ns[first : last + 1]
    if not run.true_mu.t_ns.size:
        return np.array([], dtype=bool)
    lower, true = run.mu_lower.exactly(times), true_used(run).at(times)
    known = np.isfinite(lower) & np.isfinite(true)
    return np.asarray(lower[known] <= true[known] + 1e-9)


def row_of(run: Run, braking: Braking, planned: Distances, true_m: Series, target_mps: float) -> dict[str, Any]:
    """What a braking shows; None for what it cannot tell.

    `saved_at_least_m` is what all safe curves from the first identified estimate to the end of the braking leave of the
    way that the fixed worst case needs from there; where the true way is known, no more than that leaves.
    """
    own = slice(braking.first, braking.last + 1)
    times, speeds = run.speed.t_ns[own], np.abs(run.speed.values[own])
    regime, mu = run.regimes_at(times), run.mu.exactly(times)
    adhesion, brake = (
        (regime == each.name) & np.isfinite(mu) for each in (Regime.ADHESION_LIMITED, Regime.BRAKE_LIMITED)
    )
    kept, lower = bound_kept(run, braking.first, braking.last), run.mu_lower.exactly(times)
    row: dict[str, Any] = {
        "start_s": float(run.seconds(times)[0]),
        "end_s": float(run.seconds(times)[-1]),
        "place_m": float(run.position.values[braking.first]),
        "from_kmh": float(speeds[0] / KMH),
        "to_kmh": float(speeds[-1] / KMH),
        "adhesion_share": float(adhesion.mean()),
        "brake_share": float(brake.mean()),
        "mu_low": float(mu[adhesion].min()) if adhesion.any() else None,
        "mu_high": float(mu[adhesion].max()) if adhesion.any() else None,
        "mu_at_least": float(mu[brake].max()) if brake.any() else None,
        "mu_lower": float(lower[-1]) if np.isfinite(lower[-1]) else None,
        "bound_kept_percent": 100.0 * float(kept.mean()) if kept.size else None,
        "changes_s": run.seconds(np.array(rises(run.changes, int(times[0]), int(times[-1])), dtype=np.int64)).tolist(),
        **dict.fromkeys(("identified_at_kmh", "fixed_m", "saved_at_least_m")),
    }
    shown = np.flatnonzero(adhesion & (speeds < speeds[0] - CONVERGED_AFTER_MPS) & (speeds > target_mps))
    if shown.size:
        first = int(shown[0])
        place = np.abs(run.position.values[own] - run.position.values[own][first])
        needed = (place + planned.longest[own])[first:][speeds[first:] > target_mps]
        true_way = true_m.exactly(times[first : first + 1])[0]
        row |= {
            "identified_at_kmh": float(speeds[first] / KMH),
            "fixed_m": float(planned.fixed[own][first]),
            "saved_at_least_m": float(planned.fixed[own][first] - np.nanmax([*needed, true_way])),
        }
    return row

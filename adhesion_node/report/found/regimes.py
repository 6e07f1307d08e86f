# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The regimes of a run over time, and in words."""

from functools import lru_cache, reduce
from itertools import groupby
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from ...core import Regime
from ..read.run import Run
from ..read.series import in_rows

IN_WORDS = {
    Regime.COASTING.name: "nothing is claimed",
    Regime.BRAKE_LIMITED.name: "the brake limits",
    Regime.ADHESION_LIMITED.name: "the adhesion limits",
}
"""What limits the motion, by the names of the regimes."""


class Band(NamedTuple):
    """A regime and the time for which it held, seconds from the start of the run."""

    start_s: float
    end_s: float
    regime: str


@lru_cache
def bands(run: Run) -> list[Band]:
    """Regimes over time: an estimate's regime holds since the estimate before it."""
    ends = run.seconds(run.regime.t_ns)
    starts = np.concatenate(([0.0], ends))[:-1]
    known = (Band(*row) for row in in_rows(starts, ends, run.regime.values) if row[2])
    grouped = (group for _, group in groupby(known, key=attrgetter("regime")))
    return [reduce(lambda first, later: first._replace(end_s=later.end_s), group) for group in grouped]

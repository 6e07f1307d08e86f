# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The estimates of a recording as rows of the columns that an offline replay writes."""

import math
from collections.abc import Iterator

from ...run.results.rows import COLUMNS, LEARNT, Row
from ..read.run import Run
from ..read.series import in_rows

KEYS = ("mu_std", "window", *LEARNT)
"""What the diagnostics are asked for; they tell five digits."""


def rows_of(run: Run, sign: int) -> Iterator[Row]:
    """Yield a row for each estimate; None for what was not recorded, or was withheld.

    `sign` is -1 where the chainage, which the rows have, falls along the run.
    """
    times = run.speed.t_ns
    series = {
        **run.told,
        "braking": run.told["window"],
        "position_m": run.position.map(lambda place: sign * place),
        "speed_mps": run.speed,
        "mu": run.mu,
        "mu_lower": run.mu_lower,
        "safe_m": run.safe.lengths(0.0),
        "nominal_m": run.nominal.lengths(0.0),
    }
    numbers = {name: series[name].exactly(times) for name in COLUMNS if name in series}
    columns = {"t_ns": times, **numbers, "regime": run.regimes_at(times)}
    for values in in_rows(*(columns[name] for name in COLUMNS)):
        known = (None if value == "" or (isinstance(value, float) and math.isnan(value)) else value for value in values)
        row = dict(zip(COLUMNS, known, strict=True))
        braking = row["braking"]
        yield row | {"braking": None if braking is None else int(braking)}

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The picture of how the cost grows."""

from collections.abc import Iterable, Mapping
from itertools import groupby
from typing import Any

import numpy as np

from ..study.trial.drawing import STYLES, picture
from ..study.trial.figures import Place

NAMES = {
    "rate_hz": "rate, 5 Hz and more",
    "trains": "trains in one process",
    "hypotheses": "hypotheses of the bank, 10 and more",
    "nuisance": "nuisance parameters",
    "window": "S of rail_condition, 25 and more",
}
"""What grows, as a reader knows it."""

TICKS = (1, 2, 5, 10, 20)


def draw(rows: Iterable[Mapping[str, Any]], place: Place) -> None:
    """Draw the cost over the size, both as multiples of the least, with a line for what grows as the size does."""
    with picture(place, "How the cost grows: exponents of power laws") as axis:
        most = 1.0
        for (color, dashes), (name, some) in zip(STYLES, groupby(rows, lambda row: row["grows"]), strict=False):
            found = list(some)
            size, ms = (np.array([row[column] for row in found]) for column in ("size", "ms"))
            label = f"{NAMES[name]}: {round(found[0]['exponent'], 1) + 0.0:.1f}"  # 0.0 where it is -0.0
            axis.loglog(size / size[0], ms / ms[0], color=color, ls=dashes, marker="o", ms=3, lw=1.4, label=label)
            most = max(most, size[-1] / size[0])
        axis.loglog([1.0, most], [1.0, most], color="0.8", lw=3.0, zorder=0, label="as the size: 1")
        for ticks in (axis.set_xticks, axis.set_yticks):
            ticks(TICKS, map(str, TICKS))
            ticks([], minor=True)
        axis.set(xlabel="size, over the least", ylabel="processor time, over that of the least")
        axis.legend(loc="upper left")

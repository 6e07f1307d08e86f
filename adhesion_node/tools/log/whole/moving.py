# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Where a train moves: by its speed, or else by the way between its positions or fixes."""

import numpy as np
import pandas as pd

from ....core.physics.train import Array
from ..cell.numbers import Flags
from .steps import DEGREE_M

MOVES_MPS, OVER_S = 2.0, 5.0
"""A train that is faster moves; slower positions, over so long, are noise."""


def moves(rows: pd.DataFrame) -> Flags:
    """Rows of a train that moves, as parked its pipe may be empty for longer than it runs; all, where it never does."""
    speed = rows["speed"].abs().ffill().to_numpy() if "speed" in rows else _way_m(rows) / OVER_S
    fast: Flags = speed > MOVES_MPS
    return fast | (not fast.any())


def _way_m(rows: pd.DataFrame) -> Array:
    """Way over the `OVER_S` about every row, by positions or else by fixes; shape (n,)."""
    t_s, squares = rows["t_ns"].to_numpy() / 1e9, np.zeros(len(rows))
    by_fix = {"lat": DEGREE_M, "lon": DEGREE_M * np.cos(np.radians(rows["lat"].median()))} if "lat" in rows else {}
    for name, metres in ({"position": 1.0} if "position" in rows else by_fix).items():
        known = rows[name].notna().to_numpy()
        if known.any():
            at = [np.interp(t_s + by, t_s[known], rows[name][known]) for by in (-OVER_S / 2, OVER_S / 2)]
            squares += np.square(metres * (at[1] - at[0]))
    return np.sqrt(squares)

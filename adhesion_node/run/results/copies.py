# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Brakings that are there more than once, as of copied recordings or of tables that overlap."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from .brakings import BRAKING

NUMBERS = list(BRAKING.names or ())

ALIKE, APART, SOON_NS = 1e-6, 1e-4, 1_000_000
"""To within which numbers of copies agree, relative and absolute, and stamps: files round them."""


def without_copies(rows: pd.DataFrame) -> tuple[pd.DataFrame, Iterator[str]]:
    """Return the first of each braking, and what is said of the others: no two agree in stamps and in every number."""
    stamps = rows["t_ns"].to_numpy(np.int64)
    numbers = rows[NUMBERS].to_numpy(np.float64)
    of = np.arange(len(rows))
    lately = list[int]()
    for row in np.argsort(stamps, kind="stable").tolist():
        lately = [one for one in lately if stamps[row] - stamps[one] <= SOON_NS]
        alike = np.isclose(numbers[row], numbers[lately], ALIKE, APART, equal_nan=True).all(axis=1)
        if alike.any():
            of[row] = lately[int(alike.argmax())]
        else:
            lately.append(row)
    copied = of != np.arange(len(rows))
    recording = rows["recording"].astype(str).to_numpy()
    found = pd.DataFrame({"path": recording, "of": recording[of]})[copied].groupby(["path", "of"]).size()
    return rows[~copied], (_told(path, first, count) for (path, first), count in found.items())


def _told(path: str, of: str, count: int) -> str:
    where = "there again" if path == of else f"in {of}, too"
    return f"{path}: brakings that are {where}: {count}; each counts once: give them once"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Brakings that are there more than once, as of copied recordings or of tables that overlap."""

from collections.abc import Iterator

import pandas as pd

from .brakings import BRAKING

NUMBERS = list(BRAKING.names or ())

DIGITS = 6
"""To which numbers are compared: a CSV file may read as another in the last place."""


def without_copies(rows: pd.DataFrame) -> tuple[pd.DataFrame, Iterator[str]]:
    """Return the first of each braking, and what is said of the others: no two agree in stamps and in every number."""
    rounded = rows.reset_index(drop=True).round(dict.fromkeys(NUMBERS, DIGITS))
    rounded["recording"] = rounded["recording"].astype(str)
    copied = rounded.duplicated(NUMBERS)
    first = rounded.groupby(NUMBERS, dropna=False)["recording"].transform("first")
    found = rounded.assign(of=first)[copied].groupby(["recording", "of"]).size()
    return rows[~copied.to_numpy()], (_told(path, of, count) for (path, of), count in found.items())


def _told(path: str, of: str, count: int) -> str:
    where = "there again" if path == of else f"in {of}, too"
    return f"{path}: brakings that are {where}: {count}; each counts once: give them once"

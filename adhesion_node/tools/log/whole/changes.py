# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Pressures that are written where they change alone, as of a bus that sends on a change."""

import pandas as pd

from ..format import PRESSURES


def between_changes(rows: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """Return the rows with the pressures that are written where they change alone, and how many were not written."""
    names = [name for name in PRESSURES if name in rows]
    known = rows[names].ffill()
    counts = (known.count() - rows[names].count()).items()
    notes = [f"{name}: as it was in {count} rows that do not tell it, --hold" for name, count in counts if count]
    return rows.assign(**{name: known[name] for name in names}), notes

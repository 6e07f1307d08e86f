# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Units that stand in every cell of a column, behind its number: `87 km/h`, `3,5 bar`."""

import re
from collections.abc import Mapping
from typing import Any

import pandas as pd

from ..format import FAMILIES
from .units import known

_NUMBER_AND_UNIT = re.compile(r"([+-]?[0-9.,' \u2019\u00a0\u2009\u202f]*[0-9](?:[eE][+-]?[0-9]+)?)\s*([^\s0-9.,:+-].*)")


def unit_in(cells: "pd.Series[Any]", column: str) -> str | None:
    """Return the unit of a column of ours as all of its cells write it, but the empty ones; None where they do not.

    >>> unit_in(pd.Series(["8 km/h", "", "7.5km/h"]), "speed"), unit_in(pd.Series(["8 km/h", "2 m/s"]), "speed")
    ('km/h', None)
    """
    is_text = pd.api.types.is_object_dtype(cells) or pd.api.types.is_string_dtype(cells)
    if column not in FAMILIES or not is_text:
        return None
    filled = [text for text in map(str, cells) if any(map(str.isdecimal, text))]
    written = {match and match[2] for match in map(_NUMBER_AND_UNIT.fullmatch, filled)}
    unit = written.pop() if len(written) == 1 else None
    return unit if unit and known(unit, column) else None


def number_in(cell: str) -> str:
    """Return a cell without a unit behind its number.

    >>> number_in("3,5 bar"), number_in("21.11.2024"), number_in("door 2")
    ('3,5', '21.11.2024', 'door 2')
    """
    match = _NUMBER_AND_UNIT.fullmatch(cell)
    return match[1] if match else cell


def without_units(cells: pd.DataFrame, units: Mapping[str, str]) -> pd.DataFrame:
    """Return the cells without these units, by the columns that have them; what else stands there is no number.

    >>> without_units(pd.DataFrame({"v": ["87 km/h", "24 m/s", ""]}), {"v": "km/h"})["v"].tolist()
    ['87', '24 m/s', '']
    """
    bare = {name: cells[name].str.removesuffix(unit).str.rstrip() for name, unit in units.items()}
    return cells.assign(**bare)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is no row of a log: lines of units, comments and types below the header, and the header in the midst again."""

import re
from collections.abc import Sequence

from .cell.units import known
from .format import UNITS

_NUMBERED = re.compile("[+-]?[.,]?[0-9](?!/[a-z])")  # 1/min is a unit


def is_head(cells: Sequence[str]) -> bool:
    """Return whether a line below the header is no row of measurements: units, comments or types, without a number.

    >>> is_head(["s", "1/min"]), is_head(["GPS clock", ""]), is_head(["", ""]), is_head(["n/a", "0.5"])
    (True, True, False, False)
    """
    return any(map(str.isalpha, "".join(cells))) and not any(map(_NUMBERED.match, cells))


def how_many_units(cells: Sequence[str]) -> int:
    """Return how many of the cells are units of anything.

    >>> how_many_units(["[s]", "km/h", "bar"]), how_many_units(["double", "double", "double"])
    (3, 0)
    """
    return sum(any(known(cell, family) for family in UNITS) for cell in cells)


def is_header(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Return whether a row names columns again."""
    return bool(cells) and cells[0][:1].isalpha() and 2 * len({*cells} & {*filter(None, names)}) >= len({*names})


def require_same(cells: Sequence[str], names: Sequence[str], where: str) -> None:
    """Raise ValueError where another header begins: what is below would be read as the columns of the first."""
    if list(cells) != list(names):
        raise ValueError(f"{where}: another header, {list(cells)} after {list(names)}: cut the log there")

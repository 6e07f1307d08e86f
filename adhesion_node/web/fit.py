# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whatever was received, made fit to be sent and shown: finite numbers of some digits."""

import math
from collections.abc import Iterable, Mapping

LARGEST = 1e9
"""Beyond it a number means nothing on this page."""


def number(value: float | str | None, digits: int) -> float | None:
    """A number, rounded; None for a text, what is not finite or too large.

    >>> number(2.54, 1), number("2.5", 1), number("NORMAL", 1), number(1e308, 1), number(math.nan, 1)
    (2.5, 2.5, None, None, None)
    """
    try:
        read = math.nan if value is None else float(value)
    except ValueError:
        return None
    return round(read, digits) if abs(read) <= LARGEST else None


def numbers(values: Mapping[str, str]) -> dict[str, float]:
    """Those values that are numbers.

    >>> numbers({"level": "NORMAL", "margin_m": "12.5", "ebi_mps": "1e308"})
    {'margin_m': 12.5}
    """
    return {key: read for key, value in values.items() if (read := number(value, 6)) is not None}


def rounded(values: Iterable[float], digits: int) -> list[float | int | None]:
    """Numbers for a chart; None, a gap, for what is not fit. Without digits they are whole.

    >>> rounded([1.26, math.inf], 1), rounded([1.26], 0)
    ([1.3, None], [1])
    """
    fit = (number(value, digits) for value in values)
    return [value if value is None or digits else int(value) for value in fit]

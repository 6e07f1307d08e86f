# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Numbers that diagnostics tell as texts, among them how many messages were not used, by reason."""

import math
from collections.abc import Mapping

CONFIDENCE, DROPPED = "confidence", "dropped."
"""Keys of numbers, the second with the reason behind it."""

MOST_SHOWN = 20
"""Letters of a text that is to be a number."""


def number(text: str) -> float:
    """A finite number; NaN for what is none."""
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def dropped(counts: Mapping[str, str]) -> dict[str, int]:
    """Messages that were not used, by reason.

    >>> dropped({"windows": "65", "dropped.LATE": "2"})
    {'LATE': 2}
    """
    told = ((key.removeprefix(DROPPED), number(value)) for key, value in counts.items() if key.startswith(DROPPED))
    return {reason: int(count) for reason, count in told if not math.isnan(count)}


def odd(counts: Mapping[str, str]) -> str:
    """What should be a number and is none, in words; empty where all is well.

    >>> odd({"regime": "COASTING", "confidence": "high", "dropped.LATE": "2"})
    "confidence = 'high'"
    """
    numbers = ((key, text) for key, text in counts.items() if key == CONFIDENCE or key.startswith(DROPPED))
    return ", ".join(f"{key} = {text[:MOST_SHOWN]!r}" for key, text in numbers if math.isnan(number(text)))


def listed(counts: Mapping[str, int]) -> str:
    """Counts by reason in words.

    >>> listed({"LATE": 2, "OLD": 1})
    '2 LATE, 1 OLD'
    """
    return ", ".join(f"{count} {reason}" for reason, count in counts.items())

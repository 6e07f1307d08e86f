# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How many messages were not used, by reason, as the diagnostics count them."""

from collections.abc import Mapping


def dropped(counts: Mapping[str, str]) -> dict[str, int]:
    """Messages that were not used, by reason.

    >>> dropped({"windows": "65", "dropped.LATE": "2"})
    {'LATE': 2}
    """
    return {key.removeprefix("dropped."): int(value) for key, value in counts.items() if key.startswith("dropped.")}


def listed(counts: Mapping[str, int]) -> str:
    """Counts by reason in words.

    >>> listed({"LATE": 2, "OLD": 1})
    '2 LATE, 1 OLD'
    """
    return ", ".join(f"{count} {reason}" for reason, count in counts.items())

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Axles that are counted backwards while the train runs on: they seem to slide."""

from collections.abc import Mapping

TURNS_RADPS = 10.0
"""Slower wheels tell no direction: they stand, or are noise."""


def turned(balance: Mapping[str, int]) -> str | None:
    """Say which axles turn backwards more often than forward; None: none does.

    >>> turned({"wheel_speed_1": 99, "wheel_speed_2": -99})
    'wheel_speed_2: turned backwards while the train runs: change the sign, wheels count forward along the run'
    """
    back = ", ".join(name for name, more in balance.items() if more < 0)
    told = "turned backwards while the train runs: change the sign, wheels count forward along the run"
    return f"{back}: {told}" if back else None

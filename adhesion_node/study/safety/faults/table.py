# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The table of faults."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..case import Case, Message, Rng
from .clocks import ahead, all_clocks, clock
from .messages import Faulty, frozen, late, lost, misled, none, restart, twice, units
from .ways import reboot, settings, target, worse

Fault = Callable[[Rng, Case, list[Message]], Faulty]

FAULTS: dict[str, Sequence[Fault]] = {
    "none": (none,),
    "lost": (lost,),
    "late, reordered": (late,),
    "sent twice": (twice,),
    "frozen": (frozen,),
    "estimator restarted": (restart,),
    "curve in other units": (units,),
    "monitor's clock": (clock,),
    "all clocks set": (all_clocks,),
    "monitor restarted": (reboot,),
    "stamps ahead": (ahead,),
    "target": (target,),
    "settings": (settings,),
    "rail gets worse": (worse,),
    "states that mislead": (misled,),
    "several at once": (reboot, lost, late, twice, frozen, restart, units, clock, target, settings),
}
"""The faults of each row of the table; where there are more than one, two of them are drawn."""

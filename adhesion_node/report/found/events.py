# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What happened in a run, in its order: regimes, changes of the rail, levels of the ATP monitor, what was not well."""

from itertools import chain

from ...core.atp.supervision import Level
from ..read.run import Run
from ..read.series import Series
from .brakings import rises
from .regimes import IN_WORDS

BRAKES = (Level.SERVICE_BRAKE.name, Level.EMERGENCY_BRAKE.name)
"""Levels at which the ATP monitor brakes."""

Event = tuple[int, str, str]
"""Time, ns; kind, as the live page has them; what is said."""


def events(run: Run) -> list[Event]:
    """Return the events from the first estimate on."""
    start_ns, end_ns = int(run.speed.t_ns[0]), int(run.speed.t_ns[-1])
    found: list[Event] = [(t_ns, "regime", IN_WORDS.get(name, name)) for t_ns, name in text_changes(run.regime)]
    found += [(t_ns, "change", "the rail has changed") for t_ns in rises(run.changes, start_ns, end_ns)]
    found += [
        (t_ns, "intervention" if level in BRAKES else "level", level.replace("_", " "))
        for t_ns, level in text_changes(run.levels)
    ]
    found += [(t_ns, "fault", said) for t_ns, said in text_changes(run.remarks)]
    return sorted(event for event in found if event[0] >= start_ns)


def text_changes(series: Series) -> list[tuple[int, str]]:
    """Times and texts at which a series of texts changes, the first included; "" is left out."""
    rows = zip(series.t_ns, series.values, chain([""], series.values), strict=False)
    return [(int(t_ns), str(text)) for t_ns, text, before in rows if text not in ("", before)]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Options that mean nothing for a log that has no such column: it is likely to have it under another name."""

import argparse
from collections.abc import Mapping
from typing import Any

from ...command.checks import refuse
from ...wire.line import ATMOSPHERE_PA
from .cell.numbers import has_dates
from .columns import Columns
from .format import PRESSURES, Format, option

AXLES = "wheel_speeds"

OF = {
    **dict.fromkeys(("position_unit", "direction"), ("position",)),
    "position_std_m": ("position", "lat"),
    **dict.fromkeys(("hold", "pressure_unit", "pressure_kind", "ambient_pressure_pa"), PRESSURES),
    **dict.fromkeys(("pipe_released", "full_pressure_pa"), ("brake_pipe",)),
    "speed_unit": ("speed", "speed_std"),
    "acceleration_unit": ("acceleration",),
    **dict.fromkeys(("wheel_unit", "wheel_radius_m"), (AXLES,)),
}
"""By option the columns of which it says something."""

USUAL = {"direction": "up", "pressure_kind": "gauge", "ambient_pressure_pa": ATMOSPHERE_PA, "time_zone": "UTC"}
"""What other options are where nothing is asked for; the rest are None."""


def asked(options: Mapping[str, Any]) -> argparse.Namespace:
    """Return what options ask for that may mean nothing, by their names; None where they ask for nothing."""
    names = (*OF, "time_zone", "time_unit", "time_format")
    return argparse.Namespace(
        **{_told(name): value if (value := options[name]) != USUAL.get(name) else None for name in names}
    )


def require_meaning(form: Format, columns: Columns) -> None:
    """Raise ValueError for the first option that means nothing for a log of these columns and times."""
    if form.asked is None:
        return
    there = {*columns.names, *([AXLES] if columns.axles else [])}
    for name, of in OF.items():
        if there.isdisjoint(of) and not (name == "full_pressure_pa" and any(map(form.is_share, columns.names))):
            cures = " or ".join(f"{option(column)} COL" for column in of)
            why = f"the log has no column of which it tells: name one with {cures}, or leave it out"
            refuse(form.asked, [_told(name)], why)
    if not has_dates(form):
        refuse(form.asked, ["time_zone"], "the times have no date, and no zone: leave it out")
    if form.asked.time_format is not None:
        refuse(form.asked, ["time_unit"], "dates by --time-format have no unit: leave the one or the other out")


def _told(name: str) -> str:
    return name.removesuffix("_m").removesuffix("_pa")

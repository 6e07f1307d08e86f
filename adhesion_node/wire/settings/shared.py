# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What nodes of the train share, and the ATP monitor's own settings, apart so that it starts without the estimators."""

from dataclasses import dataclass

from ...core.atp.config import SupervisionConfig
from ...core.setting import Setting, check_settings, setting, settings_of
from ..line import Line
from .telling import TELLING

OF_LINE = settings_of(Line)
FRAME_ID, AMBIENT, DIRECTION = (one for one in OF_LINE if one.name in ("frame", "ambient_pressure_pa", "direction"))

AUTOSTART = Setting(
    "autostart", True, "Configure and activate at start; if not, a manager of life cycles does", group="start"
)

OF_NODES_ALONE = (AUTOSTART, *TELLING)
"""What every node of the train has and no offline run asks for."""


@dataclass(frozen=True, slots=True)
class Watchdogs:
    """How soon the ATP monitor notices silence. Raises ValueError naming what is out of range."""

    check_rate_hz: float = setting(5.0, "Rate of the watchdogs", "Hz", 0.1, 100.0, group="watchdogs")
    clock_timeout_s: float = setting(
        *(2.0, "Time by the machine's clock for which the ROS clock may stand still", "s", 0.1, 3600.0),
        group="watchdogs",
    )

    def __post_init__(self) -> None:
        check_settings(self, "")


ATP_SETTINGS = (
    *(one._replace(changes=True) for one in settings_of(SupervisionConfig, group="supervision")),
    *settings_of(Watchdogs),
    *(FRAME_ID, DIRECTION, *OF_NODES_ALONE),
)
"""All settings of the ATP monitor."""

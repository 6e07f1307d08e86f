# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The settings of every node by name: what ROS parameters, parameter files, command lines and pages have in common."""

from collections.abc import Mapping
from types import MappingProxyType

from ...core import Config
from ...core.creep.config import CreepConfig
from ...core.creep.vehicle import Vehicle
from ...core.intake.samples import MAX_POSITION_M
from ...core.physics.train import Train
from ...core.setting import Setting, settings_of
from ..topics import ADHESION_INPUTS, CREEP_INPUTS
from . import sensing
from .shared import ATP_SETTINGS, OF_LINE, OF_NODES_ALONE
from .telling import TELLING

TRACK = Setting(
    "track",
    "",
    "Track profile: 'grade START END RISE', 'curve START END RADIUS ANGLE', 'tunnel START END', separated by ';'",
    "m, degrees",
    group="track",
)

TRACK_LINE = Setting(
    "track_line",
    "",
    "File with the track's centre line, GeoJSON or CSV: a fix is projected on it; its heights are the track's grades",
    group="track",
)
TRACK_START = Setting(
    "track_start_m",
    0.0,
    "Position of the first point of track_line",
    "m",
    -MAX_POSITION_M,
    MAX_POSITION_M,
    group="track",
)

TRAIN_FILE = Setting(
    "train_file",
    "",
    "File that describes the train, or high_speed, metro, freight; a parameter given beside it counts first",
    group="train's file",
)

RAIL_MAP = Setting(
    "rail_map",
    "",
    "File of the rail by place and date, of `brakings --map`: what earlier trains saw where a braking begins",
    group="track",
)

SEED = Setting("seed", 1, "Seed of the particle filter", "", 0, 2**31 - 1, group="method")

_SILENCE = "Silence of the sensor after which /diagnostics says STALE"
SENSOR_TIMEOUT = Setting("sensor_timeout_s", 0.5, _SILENCE, "s", 0.05, 3600.0, group="intake")

CHANGING = frozenset(
    {
        *("confidence", "curve_confidence", "sensor_timeout_s"),
        *("ambient_pressure_pa", "position_std_m", "max_cross_track_m"),
    }
)
"""What may change while an estimator runs: what is read and what is said of what is known, never what was learnt."""


def _marked(*settings: Setting) -> tuple[Setting, ...]:
    return tuple(one._replace(changes=one.changes or one.name in CHANGING) for one in settings)


_OF_TRAIN = settings_of(Train, "train.", "train")
SETTINGS = _marked(
    *(SEED, *OF_LINE, SENSOR_TIMEOUT, *sensing.settings(ADHESION_INPUTS), *OF_NODES_ALONE),
    *(*settings_of(Config), TRAIN_FILE, *_OF_TRAIN, TRACK, TRACK_LINE, TRACK_START, RAIL_MAP),
)
"""All settings of the estimator."""

CREEP_SETTINGS = _marked(
    SENSOR_TIMEOUT,
    *sensing.settings(CREEP_INPUTS),
    *OF_NODES_ALONE,
    *settings_of(Vehicle, group="vehicle"),
    *settings_of(CreepConfig, group="identification"),
)
"""All settings of the creep estimator."""

OF_NODES: Mapping[str, tuple[Setting, ...]] = MappingProxyType(
    {
        "estimator": SETTINGS,
        "creep_estimator": CREEP_SETTINGS,
        "atp_monitor": ATP_SETTINGS,
        **dict.fromkeys(("recorder", "replay", "live"), TELLING),
    }
)
"""The settings of every node by its name; those of the simulators are in sim_node/settings.py."""

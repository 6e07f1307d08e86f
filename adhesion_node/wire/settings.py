# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The nodes' settings by name: what ROS parameters, parameter files, command lines and pages have in common."""

import argparse
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from ..core import Config
from ..core.belief.rail_map import RailMap
from ..core.creep.config import CreepConfig
from ..core.creep.vehicle import Vehicle
from ..core.intake.samples import MAX_POSITION_M
from ..core.physics.track import Grade, Track, parse_track
from ..core.physics.train import CRH3, Train
from ..core.setting import Setting, make, settings_of
from . import parameter_file, sensing
from .codecs import Line
from .rail_map_file import read_rail_map
from .shared_settings import ATP_SETTINGS, OF_LINE, OF_NODES_ALONE
from .telling import TELLING
from .topics import ADHESION_INPUTS, CREEP_INPUTS
from .train_file import read_train

if TYPE_CHECKING:
    from .track_line import TrackLine

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

DEFAULT_TRAIN, OWN_TRAIN = "CRH3 of Xie et al. 2019, as no train is given", "by its parameters"
"""Of a train that has no file."""

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


class Setup(NamedTuple):
    """What an estimator is set up with."""

    config: Config
    seed: int
    line: Line
    sensor_timeout_s: float
    """Silence of the position after which /diagnostics says STALE; no result depends on it."""
    train: str = ""
    """The train in words, for the top of what is reported."""


class CreepSetup(NamedTuple):
    """What a creep estimator is set up with."""

    config: CreepConfig
    line: Line
    sensor_timeout_s: float
    """Silence of the wheel speeds after which /diagnostics says STALE; no result depends on it."""


def check_names(values: Mapping[str, Any], settings: Sequence[Setting]) -> None:
    """Raise ValueError naming the first value that is of no setting, or not one of those that nodes alone use."""
    names = {setting.name for setting in settings}
    for name, value in values.items():
        if name not in names:
            raise ValueError(f"setting {name} = {value!r}: there is none; choose of {', '.join(sorted(names))}")
    for one in OF_NODES_ALONE:
        one.check(values.get(one.name, one.default))


def setup_of(values: Mapping[str, Any]) -> Setup:
    """Build the estimator's set-up from values by setting name; what is not named keeps its default.

    Raises ValueError naming the setting when one is unknown, of a wrong type or out of range.
    """
    check_names(values, SETTINGS)
    named = ""
    if values.get(TRAIN_FILE.name):
        file = read_train(str(TRAIN_FILE.check(values[TRAIN_FILE.name])))
        named, values = file.name, {**file.values, **values}
    seed, timeout_s, track = (one.check(values.get(one.name, one.default)) for one in (SEED, SENSOR_TIMEOUT, TRACK))
    train = make(Train, values, "train.")
    profile, line = parse_track(str(track), train.length_m), _track_line(values)
    if line is not None:
        profile = _with_grades(profile, line.grades(train.length_m))
    of_line = make(Line, values, track=line, **sensing.of_line(ADHESION_INPUTS, values))
    track_run = profile.turned() if of_line.sign < 0 else profile
    config = make(Config, values, train=train, track=track_run, rail_map=_rail_map(values, of_line.sign))
    words = _in_words(named or (DEFAULT_TRAIN if train == CRH3 else OWN_TRAIN), train)
    return Setup(config, int(seed), of_line, float(timeout_s), words)


def preset(settings: Sequence[Setting], given: Mapping[str, Any]) -> tuple[Setting, ...]:
    """The settings with the defaults that a given train's file has for them. Raises ValueError as `read_train`."""
    if not given.get(TRAIN_FILE.name):
        return tuple(settings)
    values = read_train(str(TRAIN_FILE.check(given[TRAIN_FILE.name]))).values
    return tuple(one._replace(default=values.get(one.name, one.default)) for one in settings)


def _in_words(name: str, train: Train) -> str:
    brake = train.brake_force(train.full_pressure_pa) / train.mass_kg / (1.0 + train.rotating_mass_fraction)
    return f"{name}: {1e-3 * train.mass_kg:.4g} t, {train.length_m:.4g} m, full brake {brake:.3g} m/s^2"


def _track_line(values: Mapping[str, Any]) -> "TrackLine | None":
    """The track's centre line, where there is one; raises ValueError with what to mend in its file."""
    path, start_m = (one.check(values.get(one.name, one.default)) for one in (TRACK_LINE, TRACK_START))
    if not path:
        return None
    from .track_file import read_track_line  # only here: without a line no geodesy is loaded

    return read_track_line(str(path), float(start_m))


def _rail_map(values: Mapping[str, Any], sign: int) -> RailMap | None:
    """What earlier trains saw, where there is a file of it, in the sense of the positions."""
    path = RAIL_MAP.check(values.get(RAIL_MAP.name, RAIL_MAP.default))
    if not path:
        return None
    rail_map = read_rail_map(str(path))
    return rail_map.turned() if sign < 0 else rail_map


def _with_grades(track: Track, grades: tuple[Grade, ...]) -> Track:
    """The profile with the grades that the line's heights tell; ValueError where it has grades of its own."""
    if grades and any(isinstance(section, Grade) for section in track.sections):
        raise ValueError("track has grades and track_line has heights: leave out the one or the other")
    return Track((*track.sections, *grades), track.train_length_m)


def creep_setup_of(values: Mapping[str, Any]) -> CreepSetup:
    """Build the creep estimator's set-up, as `setup_of` does."""
    check_names(values, CREEP_SETTINGS)
    timeout_s = SENSOR_TIMEOUT.check(values.get(SENSOR_TIMEOUT.name, SENSOR_TIMEOUT.default))
    config = make(CreepConfig, values, vehicle=make(Vehicle, values))
    return CreepSetup(config, make(Line, values, **sensing.of_line(CREEP_INPUTS, values)), float(timeout_s))


def given(options: argparse.Namespace, node: str, settings: Sequence[Setting]) -> dict[str, Any]:
    """Values of `--params` and, before them, of `--set`, by name; ValueError when one cannot be read.

    `--node` names the node whose parameters are meant where a file has them for several.
    """
    values = parameter_file.read(options.params, getattr(options, "node", None) or node) if options.params else {}
    if getattr(options, "train", None):
        values |= {TRAIN_FILE.name: options.train}
    return values | dict(parse_setting(text, settings) for text in options.set)


def parse_setting(text: str, settings: Sequence[Setting] = SETTINGS) -> tuple[str, bool | int | float | str]:
    """Split "NAME=VALUE" and read the value as the type of its setting. Raises ValueError naming the setting.

    >>> parse_setting("start_mu=0.12")
    ('start_mu', 0.12)
    """
    name, separator, value = text.partition("=")
    setting = next((setting for setting in settings if setting.name == name), None)
    if setting is None or not separator:
        raise ValueError(f"setting {text!r}: write NAME=VALUE with one of {', '.join(s.name for s in settings)}")
    kind = type(setting.default)
    try:
        return name, {"true": True, "false": False}[value.lower()] if kind is bool else kind(value)
    except (ValueError, KeyError):
        raise ValueError(f"setting {name} = {value!r}: give a value of type {kind.__name__}") from None

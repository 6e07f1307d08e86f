# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What estimators are set up with, made from values by the names of settings and from the files that they name."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from ...core import Config
from ...core.belief.rail_map import RailMap
from ...core.creep.config import CreepConfig
from ...core.creep.vehicle import Vehicle
from ...core.physics.track import Grade, Track, parse_track
from ...core.physics.train import CRH3, Train
from ...core.readers import unread
from ...core.setting import Setting, make
from ..files.rail_map import odd_stamps, read_rail_map
from ..files.train import read_train
from ..line import Line
from ..topics import ADHESION_INPUTS, CREEP_INPUTS
from . import sensing
from .nodes import (
    CREEP_SETTINGS,
    RAIL_MAP,
    SEED,
    SENSOR_TIMEOUT,
    SETTINGS,
    TRACK,
    TRACK_LINE,
    TRACK_START,
    TRAIN_FILE,
)
from .shared import OF_NODES_ALONE

if TYPE_CHECKING:
    from ..track_line import TrackLine

DEFAULT_TRAIN, OWN_TRAIN = "CRH3 of Xie et al. 2019, as no train is given", "by its parameters"
"""Of a train that has no file."""


class Setup(NamedTuple):
    """What an estimator is set up with."""

    config: Config
    seed: int
    line: Line
    sensor_timeout_s: float
    """Silence of the position after which /diagnostics says STALE; no result depends on it."""
    train: str = ""
    """The train in words, for the top of what is reported."""
    unread: tuple[str, ...] = ()
    """What is given and the method does not read, or is of no effect, in words."""


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
    named, given = "", values
    if values.get(TRAIN_FILE.name):
        file = read_train(str(TRAIN_FILE.check(values[TRAIN_FILE.name])))
        given = {name: value for name, value in values.items() if value != file.values.get(name)}
        named, values = file.name, {**file.values, **values}
    seed, timeout_s, track = (one.check(values.get(one.name, one.default)) for one in (SEED, SENSOR_TIMEOUT, TRACK))
    train = make(Train, values, "train.")
    profile, line = parse_track(str(track), train.length_m), _track_line(values)
    if line is not None:
        profile = _with_grades(profile, line.grades(train.length_m))
    of_line = make(Line, values, track=line, **sensing.of_line(ADHESION_INPUTS, values))
    track_run = profile.turned() if of_line.sign < 0 else profile
    rail_map = _rail_map(values, of_line.sign)
    config = make(Config, values, train=train, track=track_run, rail_map=rail_map)
    odd = odd_stamps(str(values[RAIL_MAP.name]), rail_map.pieces) if rail_map else ()
    words = _in_words(named or (DEFAULT_TRAIN if train == CRH3 else OWN_TRAIN), train)
    return Setup(config, int(seed), of_line, float(timeout_s), words, (*unread(given, SETTINGS), *odd))


def preset(settings: Sequence[Setting], given: Mapping[str, Any]) -> tuple[Setting, ...]:
    """The settings with the defaults that a given train's file has for them. Raises ValueError as `read_train`."""
    if not given.get(TRAIN_FILE.name):
        return tuple(settings)
    values = read_train(str(TRAIN_FILE.check(given[TRAIN_FILE.name]))).values
    return tuple(one._replace(default=values.get(one.name, one.default)) for one in settings)


def _in_words(name: str, train: Train) -> str:
    size = f"{1e-3 * train.mass_kg:.4g} t, {train.length_m:.4g} m"
    return f"{name}: {size}, full brake {train.full_brake_mps2:.3g} m/s^2"


def _track_line(values: Mapping[str, Any]) -> "TrackLine | None":
    """The track's centre line, where there is one; raises ValueError with what to mend in its file."""
    path, start_m = (one.check(values.get(one.name, one.default)) for one in (TRACK_LINE, TRACK_START))
    if not path:
        return None
    from ..files.track import read_track_line  # only here: without a line no geodesy is loaded

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

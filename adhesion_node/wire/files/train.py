# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Files that describe a train in the terms of its papers; what they give the estimator are settings by name."""

import reprlib
import sys
from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from ...core.physics.train import CRH3, Train
from ...core.setting import make
from .parameters import load

SHIPPED = Path(__file__).parents[2] / "trains"
"""Examples to copy; their names do for a path."""

GEOMETRY = ("cylinder_diameter_m", "rigging_efficiency", "rigging_ratio", "pad_friction", "disc_radius_m", "pads")
RESISTANCE = ("c0", "c1", "c2")
KNOWN_TO = {
    "mass": "mass_std",
    "brake": "brake_std",
    "resistance": "resistance_std",
    "rotating_mass": "rotating_mass_std",
}
"""How well a quantity is known, and the setting that says so."""

_PLAIN = ("length_m", "wheel_radius_m", "rotating_mass_fraction")
_NEEDED = ("mass_kg", *_PLAIN, "brake", "resistance")
_OPTIONAL = ("name", "max_speed_kmh", "load", "known_to")
_SEE = "doc/train.md has the format"


class TrainFile(NamedTuple):
    """A train as its file describes it."""

    name: str
    max_speed_kmh: float
    empty_kg: float
    loaded_kg: float
    build_up_s: float
    values: Mapping[str, float]
    """Settings of the estimator by name."""

    @property
    def train(self) -> Train:
        """The train at its load."""
        return make(Train, self.values, "train.")


def read_train(path: str) -> TrainFile:
    """Read a train's file, or the shipped one of that name. Raises ValueError with key, value and remedy."""
    source = f"train = {path}"
    shipped = SHIPPED / f"{path}.yaml"
    try:
        content = load(str(shipped) if shipped.is_file() else path, once=True)
    except (OSError, ValueError, yaml.YAMLError, RecursionError) as error:
        names = ", ".join(sorted(one.stem for one in SHIPPED.glob("*.yaml")))
        raise ValueError(f"{source}: not readable ({error}): give a YAML file, or one of {names}") from error
    try:
        return _train_of(content, Path(path).stem)
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error


def _train_of(content: Any, stem: str) -> TrainFile:
    whole = _mapping(content, "the file", _NEEDED, _OPTIONAL)
    brake = _mapping(whole["brake"], "brake", ("full_pressure_pa", "build_up_s"), ("deceleration_mps2", *GEOMETRY))
    resistance = _mapping(whole["resistance"], "resistance", RESISTANCE, ())
    known_to = _mapping(whole.get("known_to", {}), "known_to", (), tuple(KNOWN_TO))
    empty, loaded, mass = _mass(whole)
    values = {f"train.{name}": _number(whole[name], name) for name in _PLAIN}
    values |= {f"train.resistance_{name}": _number(resistance[name], f"resistance: {name}") for name in RESISTANCE}
    values |= {"train.mass_kg": mass, "train.full_pressure_pa": _number(brake["full_pressure_pa"], "full_pressure_pa")}
    values |= {"brake_build_up_s": _number(brake["build_up_s"], "build_up_s")}
    values |= {"assumed_pressure_pa": values["train.full_pressure_pa"]}
    values |= {KNOWN_TO[name]: _number(std, f"known_to: {name}") for name, std in known_to.items()}
    values |= _force(brake, make(Train, values, "train."))
    top = _number(whole.get("max_speed_kmh", 160.0), "max_speed_kmh")
    if top <= 0.0:
        raise ValueError(f"max_speed_kmh = {top:g}: give a speed above 0 km/h")
    make(Train, values, "train.")  # refuses what no train has
    return TrainFile(str(whole.get("name") or stem), top, empty, loaded, values["brake_build_up_s"], values)


def _mass(whole: Mapping[str, Any]) -> tuple[float, float, float]:
    """Mass of the train empty, loaded and at its load, kg."""
    given = whole["mass_kg"]
    if not isinstance(given, Mapping):
        if "load" in whole:
            raise ValueError(f"load = {whole['load']}: means nothing without mass_kg: {{empty: ..., loaded: ...}}")
        mass = _number(given, "mass_kg")
        return mass, mass, mass
    _mapping(given, "mass_kg", ("empty", "loaded"), ())
    empty, loaded = (_number(given[name], f"mass_kg: {name}") for name in ("empty", "loaded"))
    load = _number(whole.get("load", 0.5), "load")
    if not (0.0 < empty <= loaded and 0.0 <= load <= 1.0):
        raise ValueError(f"mass_kg = {given}, load = {load:g}: give empty up to loaded, and a load from 0 to 1")
    return empty, loaded, empty + load * (loaded - empty)


def _force(brake: Mapping[str, Any], train: Train) -> dict[str, float]:
    """The settings that make the brake's force; where a deceleration is given the rigging's ratio stands for all."""
    geometry = [name for name in GEOMETRY if name in brake]
    if ("deceleration_mps2" in brake) == bool(geometry) or len(geometry) not in (0, len(GEOMETRY)):
        raise ValueError(f"brake: give deceleration_mps2, or else all of {', '.join(GEOMETRY)}")
    if geometry:
        values = {f"train.{name}": _number(brake[name], f"brake: {name}") for name in GEOMETRY}
        if not values["train.pads"].is_integer():
            raise ValueError(f"brake: pads = {values['train.pads']:g}: give a whole number")
        return values | {"train.pads": int(values["train.pads"])}
    slowing = _number(brake["deceleration_mps2"], "brake: deceleration_mps2")
    if not 0.01 <= slowing <= 5.0:
        raise ValueError(f"brake: deceleration_mps2 = {slowing:g}: give 0.01 to 5 m/s^2")
    force = slowing * train.mass_kg * (1.0 + train.rotating_mass_fraction)
    alike = replace(train, rigging_ratio=CRH3.rigging_ratio)
    return {"train.rigging_ratio": CRH3.rigging_ratio * force / alike.brake_force(train.full_pressure_pa)}


def _mapping(value: Any, what: str, needed: tuple[str, ...], optional: tuple[str, ...]) -> Mapping[str, Any]:
    """Check the keys of a mapping."""
    if not isinstance(value, Mapping):
        raise ValueError(f"{what} = {reprlib.repr(value)}: give {', '.join((*needed, *optional))}; {_SEE}")
    for key in value:
        if key not in (*needed, *optional):
            close = get_close_matches(str(key), (*needed, *optional), n=1)
            hint = f"did you mean {close[0]}?" if close else f"choose of {', '.join((*needed, *optional))}"
            raise ValueError(f"{what}: {key} means nothing: {hint}")
    missing = [name for name in needed if name not in value]
    if missing:
        raise ValueError(f"{what}: {', '.join(missing)} missing; {_SEE}")
    return value


def _number(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= sys.float_info.max:
        raise ValueError(f"{name} = {reprlib.repr(value)}: give a number")
    return float(value)

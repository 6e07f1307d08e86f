# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The estimator's settings by name: what its ROS parameters, parameter files and command lines have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

from ..core import Config
from ..core.physics.track import parse_track
from ..core.physics.train import Train
from ..core.setting import Setting, check_value, settings_of
from .codecs import Line

TRACK = Setting(
    "track",
    "",
    "Track profile: 'grade START END RISE', 'curve START END RADIUS ANGLE', 'tunnel START END', separated by ';'",
    "m, degrees",
    0.0,
    0.0,
    (),
)

SEED = Setting("seed", 1, "Seed of the particle filter", "", 0, 2**31 - 1, ())

FRAME_ID, AMBIENT = settings_of(Line)

SENSOR_TIMEOUT = Setting(
    "sensor_timeout_s", 0.5, "Silence of the sensor after which /diagnostics says STALE", "s", 0.05, 3600.0, ()
)

SETTINGS = (SEED, FRAME_ID, AMBIENT, SENSOR_TIMEOUT, *settings_of(Config), *settings_of(Train, "train."), TRACK)
"""All settings of the estimator."""


class Setup(NamedTuple):
    """What an estimator is set up with."""

    config: Config
    seed: int
    line: Line
    sensor_timeout_s: float
    """Silence of the position after which /diagnostics says STALE; no result depends on it."""


def check_names(values: Mapping[str, Any], settings: Sequence[Setting]) -> None:
    """Raise ValueError naming the first value that is of no setting."""
    names = {setting.name for setting in settings}
    for name, value in values.items():
        if name not in names:
            raise ValueError(f"setting {name} = {value!r}: there is none; choose of {', '.join(sorted(names))}")


def setup_of(values: Mapping[str, Any]) -> Setup:
    """Build the set-up from values by setting name; what is not named keeps its default.

    Raises ValueError naming the setting when one is unknown, of a wrong type or out of range.
    """
    check_names(values, SETTINGS)
    for setting in (SEED, SENSOR_TIMEOUT, TRACK):
        check_value(setting.name, values.get(setting.name, setting.default), type(setting.default), setting._asdict())
    train = Train(**{name.removeprefix("train."): value for name, value in values.items() if name.startswith("train.")})
    own = {item.name for item in fields(Config) if item.metadata}
    config = Config(
        train=train,
        track=parse_track(values.get(TRACK.name, ""), train.length_m),
        **{name: value for name, value in values.items() if name in own},
    )
    line = Line(**{setting.name: values[setting.name] for setting in (FRAME_ID, AMBIENT) if setting.name in values})
    seed, timeout_s = (values.get(setting.name, setting.default) for setting in (SEED, SENSOR_TIMEOUT))
    return Setup(config, seed, line, timeout_s)


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

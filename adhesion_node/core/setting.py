# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Settings: dataclass fields that carry their description, unit and range, for checks, parameters and tables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, fields
from typing import Any, NamedTuple


class Setting(NamedTuple):
    """A setting: its default's type is its type; `low` and `high` bound a number, `choices` a text."""

    name: str
    default: bool | int | float | str
    description: str
    unit: str
    low: float
    high: float
    choices: tuple[str, ...]
    group: str = ""
    """What the setting belongs to, for people who look for it."""


def setting(
    default: Any,
    description: str,
    unit: str = "",
    low: float = -math.inf,
    high: float = math.inf,
    choices: tuple[str, ...] = (),
    group: str = "",
) -> Any:
    """A dataclass field; `low` and `high` belong to the range of a number, `choices` are those of a text.

    `group` is the heading under which documentation and --help show it.
    """
    rule = {"description": description, "unit": unit, "low": low, "high": high, "choices": choices, "group": group}
    return field(default=default, metadata=rule)


def check_settings(instance: Any, what: str) -> None:
    """Check every setting of a dataclass instance; ValueError names `what`, the setting, its value and the remedy."""
    for item in fields(instance):
        if item.metadata:
            check_value(f"{what}{item.name}", getattr(instance, item.name), type(item.default), item.metadata)


def check_value(name: str, value: Any, kind: type, rule: Mapping[str, Any]) -> None:
    """Check one value against its type and its rule, the metadata of a setting; ValueError as above."""
    accepted = (int, float) if kind is float else kind
    if not isinstance(value, accepted) or (isinstance(value, bool) and kind is not bool):
        raise ValueError(f"{name} = {value!r}: give a value of type {kind.__name__}")
    if kind in (int, float) and not rule["low"] <= value <= rule["high"]:
        raise ValueError(f"{name} = {value!r}: give a value from {rule['low']:g} to {rule['high']:g} {rule['unit']}")
    if rule["choices"] and value not in rule["choices"]:
        raise ValueError(f"{name} = {value!r}: choose one of {', '.join(rule['choices'])}")


def settings_of(kind: type[Any], prefix: str = "") -> list[Setting]:
    """Return the settings among the fields of a dataclass."""
    defaults = kind()
    return [
        Setting(prefix + item.name, getattr(defaults, item.name), **item.metadata)
        for item in fields(kind)
        if item.metadata
    ]

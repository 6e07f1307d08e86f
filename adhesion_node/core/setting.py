# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Settings: what is declared once feeds checks, ROS parameters, parameter files, command lines and documentation.

A dataclass declares its settings as fields made by `setting`; `settings_of` lists them.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import Field, field, fields
from functools import cache
from numbers import Integral, Real
from typing import Any, NamedTuple, TypeVar

Value = bool | int | float | str

Made = TypeVar("Made")
Settings = TypeVar("Settings")

MOST_KEPT = 64
"""Settings of which something is kept at most."""


class Setting(NamedTuple):
    """A setting: its default's type is its type; `low` and `high` bound a number, `choices` a text."""

    name: str
    default: Value
    description: str
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()
    group: str = ""
    """What the setting belongs to, for people who look for it."""
    changes: bool = False
    """Whether it may change while a node runs."""

    @property
    def is_number(self) -> bool:
        """Whether it has a range."""
        return type(self.default) in (int, float)

    def check(self, value: Any, owner: str = "") -> Value:
        """Return `value` as the setting's type, an integer for a float included.

        Raises ValueError with the owner, the name, the value and what is allowed.

        >>> Setting("gain", 0.5, "a gain", high=1.0).check(1)
        1.0
        """
        kind: Any = type(self.default)
        what = f"{owner}{self.name} = {value!r}"
        if isinstance(value, float) and str(value) in self.choices:
            return str(value)  # YAML takes the words nan and inf for numbers
        accepted = {float: Real, int: Integral}.get(kind, kind)  # numbers of numpy are numbers
        if not isinstance(value, accepted) or (isinstance(value, bool) and kind is not bool):
            raise ValueError(f"{what}: give a value of type {kind.__name__} ({self.allowed()})")
        if self.choices and value not in self.choices:
            raise ValueError(f"{what}: choose {self.allowed()}")
        if self.is_number and not (self.low <= value <= self.high and math.isfinite(value)):
            raise ValueError(f"{what}: give {self.allowed()}")
        checked: Value = kind(value)
        return checked

    def allowed(self) -> str:
        """Say in words what the setting takes.

        >>> Setting("rate_hz", 10.0, "samples per second", "Hz", 0.1, 100.0).allowed()
        'a value from 0.1 to 100 Hz'
        """
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        if not self.is_number:
            return "true or false" if isinstance(self.default, bool) else "a text"
        if math.isfinite(self.low) and math.isfinite(self.high):
            return f"a value from {bound(self.low)} to {bound(self.high)} {self.unit}".rstrip()
        least = f" of at least {bound(self.low)}" if math.isfinite(self.low) else ""
        most = f" of at most {bound(self.high)}" if math.isfinite(self.high) else ""
        return f"a finite value{least}{most} {self.unit}".rstrip()


def bound(number: float) -> str:
    """The end of a range in digits; a whole one is not rounded.

    >>> bound(2**31 - 1), bound(1e8)
    ('2147483647', '1e+08')
    """
    return str(number) if isinstance(number, int) else f"{number:g}"


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


def check_settings(instance: Any, owner: str) -> None:
    """Check every setting of a dataclass instance; ValueError names `owner`, the setting, its value and the remedy."""
    for item in fields(instance):
        if item.metadata:
            _declared(item).check(getattr(instance, item.name), owner)


def settings_of(kind: type[Any], prefix: str = "", group: str = "") -> list[Setting]:
    """Return the settings among the fields of a dataclass; `group` is that of those that declare none."""
    found = (_declared(item) for item in fields(kind) if item.metadata)
    return [one._replace(name=prefix + one.name, group=one.group or group) for one in found]


def make(kind: type[Made], values: Mapping[str, Any], prefix: str = "", **others: Any) -> Made:
    """Build a dataclass from those of `values` that are its settings, and `others`; raises ValueError as it does."""
    own = {one.name.removeprefix(prefix): one.name for one in settings_of(kind, prefix)}
    return kind(**{field: values[name] for field, name in own.items() if name in values}, **others)


@cache
def _declared(item: Field[Any]) -> Setting:
    default: Any = item.default
    return Setting(item.name, default, **item.metadata)


def by_group(settings: Iterable[Setting]) -> dict[str, list[Setting]]:
    """Return the settings under their groups, both in the order of declaration."""
    groups: dict[str, list[Setting]] = {}
    for one in settings:
        groups.setdefault(one.group, []).append(one)
    return groups


def once(make: Callable[[Settings], Made]) -> Callable[[Settings], Made]:
    """Make once what belongs to settings, by their identity: to compare all of them may take longer than to make it."""
    kept: dict[int, tuple[Settings, Made]] = {}

    def made(settings: Settings) -> Made:
        found = kept.get(id(settings))
        if found is None:
            if len(kept) >= MOST_KEPT:
                kept.clear()
            kept[id(settings)] = found = settings, make(settings)  # as long as they are kept no others have their id
        return found[1]

    return made

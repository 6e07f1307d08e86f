# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Two settings for every sensor: whether it is used, and how late its stamp is."""

from collections.abc import Iterable, Mapping
from typing import Any

from ...core.setting import Setting
from ..topic import Topic

USE, LATENCY = "use_", "latency_s."

MOST_S = 60.0


def settings(topics: Iterable[Topic]) -> tuple[Setting, ...]:
    """Return the settings of sensors, which may change while a node runs."""
    names = [topic.name for topic in topics]
    used = (Setting(f"{USE}{name}", True, f"Whether {name} is used", group="sensors", changes=True) for name in names)
    late = (
        Setting(
            *(f"{LATENCY}{name}", 0.0, f"By how much a stamp of {name} is later than what it measured", "s"),
            *(0.0, MOST_S),
            group="delays",
            changes=True,
        )
        for name in names
    )
    return (*used, *late)


def of_line(topics: Iterable[Topic], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the values make of a `Line`; ValueError names a value that does not fit."""
    given = {one.name: one.check(values.get(one.name, one.default)) for one in settings(topics)}
    unused = (name.removeprefix(USE) for name, value in given.items() if name.startswith(USE) and not value)
    late = {name.removeprefix(LATENCY): value for name, value in given.items() if name.startswith(LATENCY) and value}
    return {"unused": frozenset(unused), "latency_s": late}

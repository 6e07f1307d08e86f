# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The settings of what every node tells, the simulators too, which must not know the estimators."""

from dataclasses import dataclass

from ...core.setting import check_settings, setting, settings_of

_TOLD = "diagnostics"


@dataclass(frozen=True, slots=True)
class Telling:
    """How a node speaks in /diagnostics. Raises ValueError naming what is out of range."""

    hardware_id: str = setting("", "Name of the train in /diagnostics; empty: the namespace, else train", group=_TOLD)
    diagnostics_period_s: float = setting(
        1.0, "Time, by the machine's clock, between two /diagnostics at most", "s", 0.1, 3600.0, group=_TOLD
    )

    def __post_init__(self) -> None:
        check_settings(self, "")


TELLING = tuple(settings_of(Telling))
"""The same as settings."""

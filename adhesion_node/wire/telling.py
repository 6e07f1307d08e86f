# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The settings of what every node tells, the simulators too, which must not know the estimators."""

from dataclasses import dataclass

from ..core.setting import check_settings, setting, settings_of

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

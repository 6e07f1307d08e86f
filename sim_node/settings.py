# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The settings of the simulators by name."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from adhesion_node.core.setting import Setting, settings_of
from adhesion_node.wire.settings.telling import TELLING
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import POSITION, WHEEL_SPEED

from .faults.plan import Plan
from .real.plant.scenarios import SCENARIOS as REAL
from .real.sensors.fitted import FITTED
from .slip import scenario as slip_scenario
from .slip.plant import SlipNoise
from .train import scenario
from .train.sensors import SensorSettings

SLOWEST = 0.001
"""Simulated seconds per second; no timer waits for ever."""


def _run(scenarios: Iterable[str], usual: str, rate_hz: float, awaited: Topic) -> tuple[Setting, ...]:
    """The settings of every simulated run."""
    pace = f"Simulated seconds per second, from {SLOWEST:g}; 0 = any speed"
    waiting = f"Start when so many subscribers to {awaited.name} are there"
    return (
        Setting("scenario", usual, "What happens", choices=tuple(scenarios), group="run"),
        Setting("seed", 1, "Seed of all noise", "", 0, 2**31 - 1, group="run"),
        Setting("rate_hz", rate_hz, "Samples per simulated second", "Hz", 0.1, 1000.0, group="run"),
        Setting("real_time_factor", 1.0, pace, "", 0.0, 1000.0, group="run"),
        Setting("start_time_s", 1000.0, "Stamp of the first sample", "s", 0.0, 2e9, group="run"),
        Setting("wait_for", 0, waiting, "", 0, 100, group="run"),
        Setting("exit_at_end", True, "End the program with the scenario", group="run"),
    )


SENSORS = Setting(
    "sensors",
    "gnss_wheels",
    "What a real train is fitted with",
    choices=tuple(FITTED),
    group="real train",
)

SIMULATOR = (
    *_run((*scenario.SCENARIOS, *REAL), "tunnel_entry", 10.0, POSITION),
    SENSORS,
    *settings_of(SensorSettings, group="sensors"),
    *settings_of(Plan, group="fault"),
    *TELLING,
)

SLIP_SIMULATOR = (
    *_run(slip_scenario.SCENARIOS, "creep_switch", 100.0, WHEEL_SPEED),
    *settings_of(SlipNoise, group="sensors"),
    *TELLING,
)

OF_NODES: Mapping[str, tuple[Setting, ...]] = MappingProxyType(
    {"simulator": SIMULATOR, "slip_simulator": SLIP_SIMULATOR}
)
"""By the name of the node."""

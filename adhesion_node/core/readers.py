# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which methods read a setting that others do not: given for one of those it is of no effect."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from .bank import BANK
from .methods import METHODS
from .setting import Setting

_READ_BY = {
    (BANK,): "ahead_std brake_build_up_s brake_drift curve_confidence estimate_s imu_std_mps2 lowest_mu "
    "profile_std rail_map_days rail_map_trust resistance_std speed_scale_std used_ripple",
    tuple(METHODS): "braking_noise_mps coasting_noise_mps iterations lowest_net_mu restart_s "
    "restart_sigma settled_ratio start_mu tolerance window",
    ("rail_condition",): "change_edge change_margin change_threshold creep_samples identify_noise limit_margin_sigma "
    "noise_memory_steps noise_trust_steps plausible_probability position_step_log_odds position_step_speed_share "
    "rail_drift shortest_window_s tail_dof",
    ("particle_em",): "particles undecided_start_share",
    (BANK, "rail_condition"): "grade_std law law_probability position_step_spacing_m position_step_std_m "
    "sliding_creep undecided_share",
}

READERS: Mapping[str, tuple[str, ...]] = {name: by for by, names in _READ_BY.items() for name in names.split()}
"""Methods by the name of the setting. Those that are not here all read, or, as `assumed_pressure_pa`, are told by the
papers of a train whatever the method."""


def unread(values: Mapping[str, Any], settings: Iterable[Setting]) -> Iterator[str]:
    """Say of each value beside its default that the method which is chosen, or is the default, does not read it."""
    method = values.get("method", BANK)
    for one in settings:
        value, readers = values.get(one.name, one.default), READERS.get(one.name, (method,))
        if method not in readers and value != one.default:
            yield f"{one.name} = {value}: method = {method} does not read it, {' and '.join(readers)} would"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What changes on the way: the target, the settings, the rail; and a monitor that is restarted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....core.atp.monitor import Part, Refused
from ....core.atp.received import StampedCurve
from ..case import FREE_S, Case, Message, Rng
from ..told import estimated, told
from .messages import Faulty, late, lost


def target(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """A nearer target, a slower one, one that is moved on and back; or one that is not understood."""
    from_s, by_m = rng.uniform(FREE_S, case.onset_s + 0.5), 10.0 ** rng.uniform(0.0, 3.0)
    kind = rng.integers(4)
    if kind == 0:
        return case.changed(from_s, -by_m), messages
    if kind == 1:
        return case.changed(from_s, target_speed_kmh=case.config.target_speed_kmh * rng.uniform(0.0, 1.0)), messages
    if kind == 2:
        return case.changed(from_s, by_m).changed(from_s + rng.uniform(0.0, 1.5), -by_m), messages
    return case, [*messages, Message(from_s, Refused(Part.TARGET, "points = 0"))]


def settings(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """A brake that takes longer to build up, and the settings that say so; or a lower speed on the line."""
    from_s, before = rng.uniform(FREE_S, case.onset_s + 0.5), case.config
    if rng.integers(2):
        line_kmh = max(case.train.speed(from_s) * 3.6 * rng.uniform(0.5, 1.0), before.target_speed_kmh, 1.0)
        return case.changed(from_s, line_speed_kmh=line_kmh), messages
    slower = {
        "emergency_build_up_s": before.emergency_build_up_s + rng.uniform(0.0, 5.0),
        "traction_cut_off_s": before.traction_cut_off_s + rng.uniform(0.0, 5.0),
    }
    after = replace(before, **slower)
    brake = replace(case.train.brake, pulling_s=after.traction_s, coasting_s=after.coasting_s)
    return case.changed(from_s, brake=brake, **slower), messages


def reboot(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """The monitor is killed and begins anew, with the last curve at once; its silence counts as the emergency brake."""
    del messages
    from_s = rng.uniform(FREE_S, 1.0)
    until_s = from_s + rng.uniform(0.35, 3.0)
    onset_s = until_s + rng.uniform(0.0, 4.0)
    end_s = onset_s + case.stated_s + 0.5
    case = replace(case, onset_s=onset_s, end_s=end_s, down_s=(from_s, until_s)).placed(case.train)
    case = replace(case, made_s=tuple(np.arange(0.0, end_s, case.made_s[1]).tolist()))
    messages = [one for pair in told(case, rng, [estimated(case, rng, t_s) for t_s in case.made_s]) for one in pair]
    curves = [one for one in messages if one.at_s < until_s and isinstance(one.event, StampedCurve)]
    return case, [*messages, *(one._replace(at_s=until_s) for one in curves[-1:])]


def worse(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """The rail gets worse, and what tells of it is lost or late; older curves may be used while they are valid."""
    from_s, stated_s = case.onset_s, case.stated_s + case.config.valid_for_s
    further_m = rng.uniform(0.0, 600.0)
    case = replace(
        case,
        worse=(from_s, rng.uniform(0.5, 0.9)),
        targets=tuple(one._replace(place_m=one.place_m + further_m) for one in case.targets),
        stated_s=stated_s,
        end_s=from_s + stated_s + 0.5,
        stated_m=np.inf,
        made_s=tuple(np.arange(0.0, from_s + stated_s + 0.5, case.made_s[1]).tolist()),
    )
    messages = [one for pair in told(case, rng, [estimated(case, rng, t_s) for t_s in case.made_s]) for one in pair]
    return (lost if rng.integers(2) else late)(rng, case, messages)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A case: a train before a target, what is told of it to a monitor and when, and how long the monitor may take."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ...core.atp.config import SupervisionConfig
from ...core.atp.monitor import Event
from ...core.atp.received import NS_PER_S
from .truth import Brake, Train, allowed

EPOCH_NS = 10**12
"""Of a run's time 0, by the ROS clock."""

FREE_S, FAR_M = 0.3, 1e5
"""So long, s, the target is still far ahead, m: a monitor begins with the emergency brake, and has to let go."""

LEAST_MPS = 0.5
"""Speed above the one allowed at the target, of the slowest trains."""

Rng = np.random.Generator


class Target(NamedTuple):
    """Holds from a time on, s, with the settings and the brake of that time."""

    from_s: float
    place_m: float
    changes: Mapping[str, float] = {}
    """Of the settings."""
    brake: Brake | None = None
    """Where it is another than the train's at first."""


class Message(NamedTuple):
    """Comes at a time, s."""

    at_s: float
    event: Event


class Segment(NamedTuple):
    """How far the monitor's clock is ahead of the run's time from a time on, s; None: it stands still."""

    from_s: float
    ahead_s: float | None


class Noise(NamedTuple):
    """Standard deviations of the states, and how many of them they are wrong by: drawn for each, or always the same."""

    position_std_m: float
    speed_std_mps: float
    always: tuple[float, float] | None


@dataclass(frozen=True)
class Case:
    """All that happens. Times are s of the run; the train's own are true."""

    config: SupervisionConfig
    check_s: float
    clock_timeout_s: float
    train: Train
    noise: Noise
    share: float
    """What of the true deceleration the braking curves count on."""
    points: int
    """Of a braking curve."""
    down_to_mps: float
    """Where a braking curve ends."""
    made_s: tuple[float, ...]
    """When states and curves are made."""
    onset_s: float
    """When the train would need more way than there is left, by the first target."""
    end_s: float
    stated_s: float
    """Within which the monitor must say EMERGENCY_BRAKE from then on."""
    stated_m: float
    """Way that may be missing where it judges, and lets the train go on."""
    targets: tuple[Target, ...]
    messages: tuple[Message, ...] = ()
    clock: tuple[Segment, ...] = (Segment(0.0, 0.0),)
    shift: tuple[tuple[float, float], ...] = ()
    """When the clocks of all are set, s, and by how much."""
    worse: tuple[float, float] = (np.inf, 1.0)
    """When the rail gets worse, s, and what is left of the deceleration."""
    down_s: tuple[float, float] = (np.inf, 0.0)
    """From when until when there is no monitor: it was killed, and begins anew."""
    faults: tuple[str, ...] = field(default=())

    def placed(self, train: Train) -> Case:
        """The case of another train, which needs all the way that it has left at the onset, too."""
        allowed_mps = allowed(self.config.target_speed_mps)
        speed_mps = max(train.speed(self.onset_s), allowed_mps + LEAST_MPS)  # of one that slows down by itself
        place_m = float(train.place(self.onset_s) + train.brake.needed(np.asarray(speed_mps), allowed_mps))
        return replace(self, train=train, targets=(Target(0.0, place_m + FAR_M), Target(FREE_S, place_m)))

    def changed(self, from_s: float, by_m: float = 0.0, brake: Brake | None = None, **changes: float) -> Case:
        """The case whose target is moved, or whose settings change, while it runs."""
        last = self.targets[-1]
        new = Target(max(from_s, last.from_s), last.place_m + by_m, {**last.changes, **changes}, brake or last.brake)
        return replace(self, targets=(*self.targets, new))

    def supervised(self, target: Target) -> SupervisionConfig:
        """What the monitor is set to while a target holds."""
        return replace(self.config, target_position_m=target.place_m, **target.changes)

    def stamp_ns(self, t_s: float) -> int:
        """What is stamped at a time."""
        shifted = t_s + sum(by_s for from_s, by_s in self.shift if from_s <= t_s)
        return EPOCH_NS + round(shifted * NS_PER_S)

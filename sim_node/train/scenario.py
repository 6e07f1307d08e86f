# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Scenarios as data: how fast the train runs, where the rail changes, when it brakes, and when the run ends."""

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

from adhesion_node.core.physics.adhesion import DRY, SNOW, WET, SpeedLaw
from adhesion_node.core.physics.track import LEVEL, Grade, Track, Tunnel
from adhesion_node.core.physics.train import CRH3, KMH, Train
from adhesion_node.core.setting import check_settings, setting

RUN_ON_S = 2.0
"""A run goes on so long after its end speed is reached, so that the end is seen through noise."""


@dataclass(frozen=True, slots=True)
class Rail:
    """Adhesion along the track: `laws` holds (from_position_m, law), each valid up to the next one's position.

    The first law also holds before its position. Raises ValueError when there is none or the positions do not
    increase.
    """

    laws: tuple[tuple[float, SpeedLaw], ...]
    _starts: tuple[float, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        starts = tuple(start for start, _ in self.laws)
        if not starts or any(not later > earlier for earlier, later in pairwise(starts)):
            raise ValueError(f"rail positions = {starts}: give at least one, in increasing order")
        object.__setattr__(self, "_starts", starts)

    def mu(self, position_m: float, speed_mps: float) -> float:
        """Adhesion coefficient available at a place and speed."""
        law = self.laws[max(bisect_right(self._starts, position_m) - 1, 0)][1]
        return law(speed_mps)


@dataclass(frozen=True, slots=True)
class Brake:
    """The brake: from `start_s` the cylinder pressure rises within `build_up_s` to `pressure_pa`, gauge.

    Raises ValueError naming the value that is not finite or negative (`start_s` may be infinite: no brake).
    """

    start_s: float
    pressure_pa: float = setting(CRH3.full_pressure_pa, "Pressure at the end", "Pa", low=0.0)
    build_up_s: float = setting(0.0, "0: full pressure at once, as in the paper's figures", "s", low=0.0)

    def __post_init__(self) -> None:
        check_settings(self, "brake ")
        if not self.start_s >= 0:
            raise ValueError(f"brake start_s = {self.start_s!r}: give a time of at least 0, or inf for no brake")

    def gauge_pressure(self, time_s: float) -> float:
        """Cylinder pressure, Pa above the atmosphere, at a time of the run.

        >>> [Brake(20.0, 400e3, build_up_s=2.0).gauge_pressure(t) for t in (19.9, 20.0, 21.0, 30.0)]
        [0.0, 0.0, 200000.0, 400000.0]
        """
        since = time_s - self.start_s
        if since < 0:
            return 0.0
        return self.pressure_pa * (min(since / self.build_up_s, 1.0) if self.build_up_s else 1.0)


NO_BRAKE = Brake(math.inf)


@dataclass(frozen=True, slots=True)
class Scenario:
    """A run of a train that starts at position 0 and time 0.

    It ends `RUN_ON_S` after the train is down to `end_speed_mps`, and at `end_s` at the latest. Raises ValueError
    naming the value that is out of range.
    """

    name: str
    speed_mps: float
    rail: Rail
    end_s: float
    brake: Brake = NO_BRAKE
    end_speed_mps: float | None = None
    track: Track = LEVEL
    train: Train = CRH3

    def __post_init__(self) -> None:
        for name, value in (("speed_mps", self.speed_mps), ("end_s", self.end_s)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"scenario {self.name}: {name} = {value!r}: give a finite number above 0")
        if self.end_speed_mps is not None and not 0 <= self.end_speed_mps < self.speed_mps:
            raise ValueError(
                f"scenario {self.name}: end_speed_mps = {self.end_speed_mps!r}: give at least 0 and less than speed_mps"
            )


CRUISE_S = 20.0
"""Every braking run cruises so long first."""

# The brake starts in the first sample beyond the border of the rail, on whichever side the process noise (about 1 m
# after 20 s) puts the train: the border lies half a 10 Hz sample before the place of the braking.
_BEFORE_BRAKING_S = 0.05

# 3.6 km hold the whole braking of tunnel_entry (3.5 km and the run-on). By (10) such a tunnel adds 0.000468 N/N or
# 0.0046 m/s^2, 0.6 % of the braking: an estimator that believes in a level open line reads mu too high by 0.0005.
_TUNNEL_M = 3600.0


def braking_place(speed_mps: float) -> float:
    """Position, m, of the rail's border just before the braking that follows `CRUISE_S` of cruising."""
    return speed_mps * (CRUISE_S - _BEFORE_BRAKING_S)


def _braking(
    name: str,
    from_kmh: float,
    to_kmh: float,
    *laws: tuple[float, SpeedLaw],
    track: Track = LEVEL,
    train: Train = CRH3,
    end_s: float = 200.0,
) -> Scenario:
    """Full braking after `CRUISE_S`; what differs from `LEVEL` and `CRH3` is unknown to an estimator."""
    brake = Brake(CRUISE_S)
    return Scenario(name, from_kmh * KMH, Rail(laws), end_s, brake, to_kmh * KMH, track, train)


_FROM_300, _FROM_250 = braking_place(300 * KMH), braking_place(250 * KMH)

_ENTERED = Track((Tunnel(_FROM_300, _FROM_300 + _TUNNEL_M),))

_LEFT = Track((Tunnel(_FROM_250 - 2000.0, _FROM_250),))
"""Left before the braking, so that the tunnel costs traction only: 2 km, 0.00026 N/N."""

_PATCH = ((_FROM_250 + 500.0, replace(WET, scale=0.45)), (_FROM_250 + 1500.0, WET))
"""500 m on, 1 km of the wet rail (leaves, oil) gives 0.45 of the wet adhesion."""

_TOO_LATE_S = 48.0
"""When the brake of `approach` comes."""

_ALL = (
    _braking("tunnel_entry", 300, 100, (0.0, DRY), (_FROM_300, WET), track=_ENTERED),
    _braking("tunnel_exit", 250, 50, (0.0, DRY), (_FROM_250, WET), track=_LEFT),
    Scenario("cruise", 300 * KMH, Rail(((0.0, DRY),)), 60.0),
    # A stop: the brake is weaker than the adhesion all the way.
    _braking("dry_braking", 300, 0, (0.0, DRY)),
    _braking("low_adhesion_patch", 250, 50, (0.0, WET), *_PATCH),
    _braking("constant_adhesion", 300, 100, (0.0, SpeedLaw(0.07))),
    _braking("snow", 300, 100, (0.0, SNOW)),
    _braking("scaled_wet", 300, 100, (0.0, replace(WET, scale=0.8))),
    # Worn or glazed pads: 60 % of the force that the pressure promises, less than the wet rail takes at any speed.
    _braking("weak_brake", 300, 100, (0.0, WET), train=replace(CRH3, pad_friction=0.6 * CRH3.pad_friction)),
    _braking("grade_unknown", 300, 100, (0.0, WET), track=Track((Grade(0.0, 20e3, -100.0),))),
    _braking("overweight", 300, 100, (0.0, WET), train=replace(CRH3, mass_kg=1.1 * CRH3.mass_kg)),
    # Runs on towards its target, through every level of the supervision, and brakes when nothing is left.
    Scenario("approach", 160 * KMH, Rail(((0.0, DRY),)), 150.0, Brake(_TOO_LATE_S), 50 * KMH),
    # A quarter of the wet adhesion: for more than three minutes nothing changes, and no change may be reported.
    _braking("long_braking", 300, 100, (0.0, replace(WET, scale=0.25)), end_s=400.0),
)

SCENARIOS: Mapping[str, Scenario] = {scenario.name: scenario for scenario in _ALL}
"""The scenarios by name."""


def find(name: str) -> Scenario:
    """Return the scenario of that name; ValueError naming it and listing the known ones when there is none."""
    if name not in SCENARIOS:
        raise ValueError(f"scenario = {name!r}: give one of {', '.join(SCENARIOS)}")
    return SCENARIOS[name]

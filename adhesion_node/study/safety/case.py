# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A case: a train before a target, what is told of it to a monitor and when, and how long the monitor may take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ...core.atp.config import SupervisionConfig
from ...core.atp.monitor import TICKS, Event, Part, Refused
from ...core.atp.received import NS_PER_S, StampedCurve, TrainState
from ...core.physics.braking import BrakingCurve
from ...wire.line import NOMINAL
from ...wire.messages.codec import plain
from ...wire.messages.curves import read_curve, write_curve
from ...wire.messages.refused import Rejected
from .truth import Brake, Train, allowed

EPOCH_NS = 10**12
"""Of a run's time 0, by the ROS clock."""

ROUNDING_M = 0.01
"""Of ways of up to 100 km."""

FREE_S, FAR_M = 0.3, 1e5
"""So long, s, the target is still far ahead, m: a monitor begins with the emergency brake, and has to let go."""

LEAST_MPS = 0.5
"""Speed above the one allowed at the target, of the slowest trains."""

Rng = np.random.Generator

WORST = (-1.0, -1.0)
"""States as far behind the train, and as slow, as they may be."""


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


def often(rng: Rng) -> bool:
    """Three times in four: what is worst, so that the monitor is tried where it has nothing to spare."""
    return bool(rng.integers(4))


def draw(rng: Rng) -> Case:
    """A train on its way towards a target, and its settings; no message yet."""
    warning_s = rng.uniform(0.0, 3.0)
    margins = bool(rng.integers(2))
    config = SupervisionConfig(
        target_position_m=0.0,
        target_speed_kmh=float(rng.choice([0.0, 40.0, 100.0, 160.0])),
        line_speed_kmh=500.0,
        emergency_build_up_s=rng.uniform(0.0, 5.0),
        service_build_up_s=rng.uniform(0.0, 5.0),
        traction_cut_off_s=rng.uniform(0.0, 10.0),
        warning_time_s=warning_s,
        driver_time_s=warning_s + rng.uniform(0.0, 3.0),
        acceleration_mps2=rng.uniform(0.0, 1.0),
        speed_margin_mps=0.5 if margins else 0.0,
        position_margin_m=5.0 if margins else 0.0,
        margin_sigma=rng.uniform(1.0, 4.0),
        valid_for_s=rng.uniform(0.5, 3.0),
        max_ahead_s=float(rng.choice([0.0, 0.1, 0.3])),
    )
    least = allowed(config.target_speed_mps) + LEAST_MPS
    speed_mps = rng.uniform(max(least, 12.0), 97.0) if often(rng) else rng.uniform(least, least + 12.0)
    standing_mps2, fading_mps = rng.uniform(0.2, 1.6), float(rng.choice([20.0, 60.0, 1e9, -300.0]))
    knee_mps = speed_mps * rng.choice([rng.uniform(0.0, 1.0), rng.uniform(0.94, 1.02)])
    most_mps2 = 10.0 if rng.integers(2) else standing_mps2 / (1.0 + knee_mps / fading_mps)
    train = Train(
        speed_mps,
        config.acceleration_mps2 * (1.0 if often(rng) else rng.uniform(-0.3, 1.0)),
        Brake(config.traction_s, config.coasting_s, standing_mps2, fading_mps, most_mps2, config.acceleration_mps2),
    )
    period_s, onset_s, check_s = rng.uniform(0.2, 0.8), rng.uniform(0.5, 1.5), rng.uniform(0.1, 0.3)
    stated_s = TICKS * check_s + config.max_ahead_s
    end_s = onset_s + stated_s + 0.5
    return Case(
        config,
        check_s,
        rng.uniform(0.5, 2.0),
        train,
        Noise(10.0 ** rng.uniform(-1.0, 1.25), 10.0 ** rng.uniform(-1.3, 0.3), WORST if often(rng) else None),
        1.0 if often(rng) else rng.uniform(0.7, 1.0),
        64 if often(rng) else round(2.0 * 10.0 ** rng.uniform(0.0, 2.0)),
        0.0 if often(rng) else rng.uniform(0.0, 1.0) * config.target_speed_mps,
        tuple(np.arange(0.0, end_s, period_s).tolist()),
        onset_s,
        end_s,
        stated_s,
        ROUNDING_M,
        (),
    ).placed(train)


def estimated(case: Case, rng: Rng, t_s: float, noise: Noise | None = None) -> TrainState:
    """What an honest estimator says of a time: wrong by `margin_sigma` standard deviations at most."""
    noise = noise or case.noise
    wrong = noise.always or tuple(rng.uniform(-1.0, 1.0, 2))
    sigma = case.config.margin_sigma
    return TrainState(
        case.stamp_ns(t_s),
        case.train.place(t_s) + sigma * wrong[0] * noise.position_std_m,
        case.train.speed(t_s) + sigma * wrong[1] * noise.speed_std_mps,
        noise.position_std_m,
        noise.speed_std_mps,
    )


def curve_of(case: Case, state: TrainState, made_s: float = 0.0) -> StampedCurve:
    """The braking of a state, by the true law of the time when it is made, and no better."""
    brake = (case.train.brake if made_s < case.worse[0] else worse_brake(case)).times(case.share)
    speed = np.linspace(max(abs(state.speed_mps), case.down_to_mps), case.down_to_mps, case.points)
    slowing, left = brake.slowing(speed), brake.way(speed)
    time = np.concatenate(([0.0], np.cumsum(2.0 * -np.diff(speed) / (slowing[1:] + slowing[:-1]))))
    return StampedCurve(state.t_ns, state.position_m, BrakingCurve(left[0] - left, speed, slowing, time))


def worse_brake(case: Case) -> Brake:
    """The brake once the rail has got worse."""
    return case.train.brake.times(case.worse[1])


def in_units(curve: StampedCurve, of_place: float, of_speed: float, of_slowing: float) -> StampedCurve | Refused:
    """What a reader makes of a curve whose columns, from its beginning on, are in other units."""
    one = curve.curve
    other = BrakingCurve(
        one.distance_m * of_place, one.speed_mps * of_speed, one.deceleration_mps2 * of_slowing, one.time_s
    )
    fields = write_curve(plain, curve.t_ns, curve.position_m, other)
    try:
        return read_curve(plain("", **fields), NOMINAL)
    except Rejected as refusal:
        return Refused(Part.CURVE, str(refusal))


def told(case: Case, rng: Rng, made: Sequence[TrainState]) -> list[tuple[Message, Message]]:
    """States and the curves made of them, each soon after its stamp, in any order."""
    pairs = []
    for made_s, state in zip(case.made_s, made, strict=True):
        at_s = made_s + rng.uniform(0.03, 0.2)
        apart_s = rng.uniform(-0.02, 0.02)
        pairs.append((Message(at_s, state), Message(at_s + apart_s, curve_of(case, state, made_s))))
    return pairs

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a monitor is told of a case: states as an honest estimator says them, and the curves made of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.atp.monitor import Part, Refused
from ...core.atp.received import StampedCurve, TrainState
from ...core.physics.braking import BrakingCurve
from ...wire.line import NOMINAL
from ...wire.messages.codec import plain
from ...wire.messages.curves import read_curve, write_curve
from ...wire.messages.refused import Rejected
from .case import Case, Message, Noise, Rng
from .truth import Brake


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

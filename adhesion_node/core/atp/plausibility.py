# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a state and a braking curve must keep to before a distance is read off them.

A complaint says what is wrong with which value, and the remedy; "" says that all is well.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

from ..physics.train import KMH
from .config import SupervisionConfig
from .received import NS_PER_S, StampedCurve, TrainState

MAX_EXCESS_MPS = 20 * KMH
"""How far the speed judged and the curve's first may be apart: what a train gains while a curve is valid, and the
standard deviations of a state that is just good enough. A curve all in feet is consistent, but begins elsewhere."""

SPEED_TOLERANCE_MPS = 0.01
"""A curve that ends so close to the target speed reaches it: km/h and m/s are rounded differently."""

COURSE_S, SPACING_S = 10.0, 0.4
"""Time over which places and speeds of the states must agree, and between two of those that are held together."""


class Course(NamedTuple):
    """The states of the last seconds, the present one last: places and speeds must tell of the same way."""

    states: tuple[TrainState, ...] = ()

    def after(self, state: TrainState) -> Course:
        """Take the next state in; a gap, or a time that does not go on, begins anew."""
        if not self.states or not 0 < state.t_ns - self.states[-1].t_ns <= COURSE_S * NS_PER_S:
            return Course((state,))
        kept = self.states
        if len(kept) > 1 and kept[-1].t_ns - kept[-2].t_ns < SPACING_S * NS_PER_S:
            kept = kept[:-1]
        return Course((*(one for one in kept if state.t_ns - one.t_ns <= COURSE_S * NS_PER_S), state))

    def complaint(self, config: SupervisionConfig) -> str:
        """Say whether the train runs back, or its places otherwise than its speeds.

        Both may differ by what the supervision leaves as margin for them. The greatest single step of the places is
        left out: a balise corrects them.
        """
        first, last = self.states[0], self.states[-1]
        foremost = max(range(len(self.states)), key=lambda index: self.states[index].position_m)
        back_m = -_gradual([later.position_m - one.position_m for one, later in pairwise(self.states[foremost:])])
        unsure_m = config.margin_sigma * (self.states[foremost].position_std_m + last.position_std_m)
        if back_m > config.roll_back_tolerance_m + unsure_m:
            return (
                f"the train runs back, by {back_m:.3g} m so far: positions must grow in the direction of travel: "
                "set direction to down where the chainage falls along the run, here and in the estimator"
            )
        apart_m = abs(_gradual([_apart(*two) for two in pairwise(self.states)]))
        span_s = (last.t_ns - first.t_ns) / NS_PER_S
        unsure_m = config.position_margin_m + config.margin_sigma * (first.position_std_m + last.position_std_m)
        unsure_mps = config.speed_margin_mps + config.margin_sigma * max(one.speed_std_mps for one in self.states)
        if apart_m > unsure_m + unsure_mps * span_s:
            return (
                f"its places and its speeds differ by {apart_m:.3g} m within {span_s:.3g} s: is the position sensor "
                "right, in m, growing in the direction of travel, is direction that of the estimator?"
            )
        return ""


def _apart(one: TrainState, later: TrainState) -> float:
    """Way by the places less way by the speeds, m."""
    way = (one.speed_mps + later.speed_mps) / 2.0 * (later.t_ns - one.t_ns) / NS_PER_S
    return later.position_m - one.position_m - way


def _gradual(steps: list[float]) -> float:
    """The sum of steps but the greatest."""
    return sum(steps) - max(steps, key=abs, default=0.0)


def of_state(config: SupervisionConfig, state: TrainState, now_ns: int) -> str:
    """Say whether a state is out of date or too unsure."""
    for what, std, most, unit in (
        ("position", state.position_std_m, config.max_position_std_m, "m"),
        ("speed", state.speed_std_mps, config.max_speed_std_mps, "m/s"),
    ):
        if not std <= most:  # True for NaN
            name = f"max_{what}_std_m{'ps' if what == 'speed' else ''}"
            return (
                f"is too unsure: its {what} has a standard deviation of {std:.3g} {unit}, at most {most:g} is used "
                f"({name}); does the position sensor work, has the estimator just started?"
            )
    return out_of_date(config, state.age_s(now_ns))


def of_curve(config: SupervisionConfig, braking: StampedCurve, state: TrainState, now_ns: int) -> str:
    """Say whether a braking curve is out of date, of another place, too short, or better than any brake."""
    curve, (_, speed_mps) = braking.curve, state.at_most(config, now_ns)
    first, last, target = float(curve.speed_mps[0]), float(curve.speed_mps[-1]), config.target_speed_mps
    strongest = float(curve.deceleration_mps2.max())
    if late := out_of_date(config, braking.age_s(now_ns)):
        return late
    if strongest > config.max_deceleration_mps2:
        return (
            f"decelerates by {strongest:.3g} m/s^2, at most {config.max_deceleration_mps2:g} is believed "
            "(max_deceleration_mps2): give m/s^2"
        )
    if abs(max(first, target) - max(speed_mps, target)) > MAX_EXCESS_MPS:
        return (
            f"begins at {first / KMH:.1f} km/h but the train runs at {speed_mps / KMH:.1f} km/h at most: give speeds "
            "in m/s, from the train's own on"
        )
    if last > target + SPEED_TOLERANCE_MPS:
        return f"ends at {last / KMH:.1f} km/h, above the target speed {target / KMH:.1f} km/h: make it longer"
    return _misplaced(config, braking, state)


def _misplaced(config: SupervisionConfig, braking: StampedCurve, state: TrainState) -> str:
    """Say whether a curve begins elsewhere than where the train was at its time."""
    since_s = (state.t_ns - braking.t_ns) / NS_PER_S
    expected = braking.position_m + state.speed_mps * since_s
    unsure_mps = config.speed_margin_mps + config.margin_sigma * state.speed_std_mps
    unsure_m = config.position_margin_m + config.margin_sigma * state.position_std_m
    allowed = unsure_m + unsure_mps * abs(since_s) + config.max_deceleration_mps2 * since_s**2 / 2.0
    if abs(state.position_m - expected) <= allowed:
        return ""
    return (
        f"begins at {braking.position_m:.6g} m, by which the train should be at {expected:.6g} m, but it is at "
        f"{state.position_m:.6g} m: give places along the track in m, from the train's own on"
    )


def out_of_date(config: SupervisionConfig, age_s: float) -> str:
    """Say whether something is too old, or ahead of the clock."""
    if age_s > config.valid_for_s:
        valid = f"valid for {config.valid_for_s:g} s"
        return f"expired: {age_s:.3g} s old, {valid}; is the estimator running, use_sim_time right?"
    if age_s < -config.max_ahead_s:
        most = f"at most {config.max_ahead_s:g} s are used (max_ahead_s)"
        return f"is stamped {-age_s:.3g} s ahead of the clock, {most}; is use_sim_time right, are the clocks in step?"
    return ""

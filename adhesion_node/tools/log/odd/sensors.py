# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whether accelerometer and wheels tell of the same motion as positions and speed; if not, in which unit they do."""

import math
from collections.abc import Iterator

import numpy as np

from ....run.turned import TURNS_RADPS, turned
from ..format import ACCELERATION_UNITS, Format, wheel_units
from ..whole.read import Log
from .motion import BRAKES_MPS2, LEAST_S, OVER_S, RUNS_MPS2, SAME, Motion

SIMILAR = 3.0
"""An accelerometer feels so many times what the speed changes by at most, and a part as small: grades are not felt."""

STEEPEST_MPS2 = 0.45
"""Of a grade of 45 in 1000; most railways have less."""

RUNS_MPS = 5.0
"""Slower wheels tell nothing of their radius."""

RADII_M = 0.2, 0.65
"""Of the wheels of trains."""

JUST = math.log(1.04)
"""By so much those of a train may differ, as they are worn: km/h read as rad/s look like wheels of 0.28 m, a tram's."""


def felt(motion: Motion, form: Format) -> Iterator[str]:
    """What an accelerometer feels is the change of the speed, over seconds in which a train brakes."""
    felt_mps2 = np.convolve(motion.felt_mps2, np.full(OVER_S, 1.0 / OVER_S))[: motion.felt_mps2.size]
    slows = motion.slows_mps2
    braking = np.isfinite(felt_mps2) & (slows < BRAKES_MPS2)
    if braking.sum() < OVER_S:
        return
    ratio = float((felt_mps2 * slows)[braking].sum() / np.square(slows[braking]).sum())
    told = f"the acceleration is {ratio:.2g} times what the speed changes by while the train brakes"
    for unit, mps2 in ACCELERATION_UNITS.items():
        other = ACCELERATION_UNITS[form.unit("acceleration")] / mps2
        if unit != form.unit("acceleration") and abs(math.log(max(abs(ratio), 1e-9) / other)) < 2.0 * SAME:
            yield f"{told}: another unit? --acceleration-unit {unit}"
            return
    if -SIMILAR < ratio < -1.0 / SIMILAR:
        yield f"{told}: change its sign, it counts forward along the run"
    elif not 1.0 / SIMILAR < ratio < SIMILAR:
        yield f"{told}: in another unit, or along another axis than the track?"


def shifted(motion: Motion) -> Iterator[str]:
    """What an accelerometer feels beside the change of the speed is a grade, or an error."""
    felt_mps2 = np.convolve(motion.felt_mps2, np.full(OVER_S, 1.0 / OVER_S))[: motion.felt_mps2.size]
    beside = felt_mps2 - motion.slows_mps2
    known = beside[np.isfinite(beside) & (motion.fastest_mps > RUNS_MPS)]
    if known.size > LEAST_S and abs(off := float(np.median(known))) > STEEPEST_MPS2:
        yield (
            f"the acceleration is {off:+.2g} m/s^2 beside what the speed changes by, more than any grade makes: is it "
            "that of another axis, or off? Subtract it"
        )


def turning(log: Log, motion: Motion) -> Iterator[str]:
    """Wheels turn forward while positions rise, or the speed is above 0."""
    course = motion.course_mps if np.isfinite(motion.course_mps).any() else motion.speed_mps
    axles = [name for name in log.columns.axles if name in log.rows]
    if not np.nansum(course) < 0.0:
        forward, back = (log.rows[axles] > TURNS_RADPS).sum(), (log.rows[axles] < -TURNS_RADPS).sum()
        yield from filter(None, [turned((forward - back).to_dict())])


def rolling(motion: Motion, form: Format) -> Iterator[str]:
    """Wheels that roll turn as often as the way asks for."""
    course = np.abs(motion.course_mps) if np.isfinite(motion.course_mps).any() else motion.fastest_mps
    known = np.isfinite(course + motion.rolls_radps) & (course > RUNS_MPS) & ~(motion.slows_mps2 < RUNS_MPS2)
    if known.sum() < LEAST_S:
        return
    radius_m = float(np.median(course[known] / np.maximum(motion.rolls_radps[known], 1e-6)))
    units, is_a_trains = wheel_units(form.wheel_radius_m), RADII_M[0] <= radius_m <= RADII_M[1]
    if abs(math.log(radius_m / form.wheel_radius_m)) < SAME:
        return
    for unit, radps in units.items():
        off = abs(math.log(radius_m * units[form.unit("wheel_speed")] / radps / form.wheel_radius_m))
        if unit != form.unit("wheel_speed") and off < (JUST if is_a_trains else SAME):
            yield f"the wheels turn as if their radius were {radius_m:.2g} m: another unit? --wheel-unit {unit}"
            return
    if not is_a_trains:
        yield f"the wheels turn as if their radius were {radius_m:.2g} m: are --wheel-unit and --wheel-radius right?"

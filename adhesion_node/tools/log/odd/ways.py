# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whether the positions of a log tell of a train's way: in which unit, which way, and what the speed says of it."""

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from ....core.physics.train import Array
from ....run.results.seen import FASTEST_MPS
from ..format import POSITION_UNITS, SPEED_UNITS, Format
from ..whole.clock import moment
from ..whole.moving import MOVES_MPS
from ..whole.read import Log
from .motion import LEAST_M, LEAST_S, SAME, Motion
from .sensors import JUST
from .sentinels import LEAPS

ONE_WAY = 0.9
"""Where a train moves its positions rise, or fall, for so much of its way."""


def leaps(log: Log, t_s: Array) -> Iterator[str]:
    """Positions that leap faster than any train: single falls that are not made good again are those of an odometer."""
    yield from _speeds_leap(log, t_s)
    known = log.rows["position"].notna().to_numpy() if "position" in log.rows else np.zeros(len(t_s), dtype=bool)
    place, t_ns, steps_s = log.rows.get("position", t_s)[known], log.rows["t_ns"][known], np.diff(t_s[known])
    steps = np.diff(place)
    leapt = (np.abs(steps) > LEAST_M) & (np.abs(steps) > FASTEST_MPS * steps_s)
    fallen = np.flatnonzero(leapt & (steps < 0.0))
    if 4 * min(len(fallen), leapt.sum() - len(fallen)) > len(steps) > LEAST_S:
        yield "the positions leap there and back row by row: are several quantities in one column? Give each its own"
    elif 2 * len(fallen) > leapt.sum() and 10 * len(fallen) < len(steps) and steps[~leapt].sum() > 0.0:
        i, times = int(fallen[0]), f", {len(fallen)} times so" if len(fallen) > 1 else ""
        before, behind, when = place.iloc[i], place.iloc[i + 1], moment(t_ns.iloc[i + 1])
        yield (
            f"the positions fall at once from {before:.6g} to {behind:.6g} m at {when}{times}: an odometer that "
            "begins anew: cut the log there, or add to what is behind what it fell by"
        )


def _speeds_leap(log: Log, t_s: Array) -> Iterator[str]:
    """Speeds that no train changes by so fast, up and down nearly as often: of two trains, or of two quantities."""
    known = log.rows["speed"].notna().to_numpy() if "speed" in log.rows else np.zeros(len(t_s), dtype=bool)
    steps, steps_s = np.diff(log.rows.get("speed", t_s)[known]), np.diff(t_s[known])
    least, per_s = LEAPS["speed"]
    leapt = np.abs(steps) > least + per_s * steps_s
    fallen = np.count_nonzero(leapt & (steps < 0.0))
    if 4 * min(fallen, leapt.sum() - fallen) > len(steps) > LEAST_S:
        yield "the speeds leap there and back row by row: are several quantities in one column? Give each its own"


def radians(log: Log) -> Iterator[str]:
    """Degrees of no railway: all between the coasts of Ghana and Brazil."""
    if {"lat", "lon"} <= set(log.rows):
        lat, lon = (log.rows[name].abs().max() for name in ("lat", "lon"))
        if lat <= math.pi / 2.0 and lon <= math.pi:
            yield f"lat and lon are {lat:.4g} and {lon:.4g} at most: are they radians? Write degrees"


def speed_against_positions(motion: Motion, form: Format) -> Iterator[str]:
    """Positions and speeds tell the same way; if not, what the one is of the other tells why."""
    course, speed = motion.course_mps[motion.both], motion.pace_mps[motion.both]
    ratio = float((np.abs(course) * speed).sum() / (speed * speed).sum())
    if not motion.by_fixes:
        yield from _against_chainage(motion, course[speed > MOVES_MPS], 0.0)
        if course.sum() > 0.0 > motion.speed_mps[motion.both].sum():
            yield "the speed is below 0 while the positions rise: change its sign, it counts forward along the run"
    told = f"the positions move at {ratio:.3g} times the speed"
    if abs(math.log(max(ratio, 1e-30))) < SAME:
        return

    def off(units: tuple[str, str]) -> float:
        """By how much the ratio differs from that of these units."""
        place_m, pace_mps = POSITION_UNITS[units[0]], SPEED_UNITS[units[1]]
        other = pace_mps / SPEED_UNITS[form.unit("speed")] / (place_m / POSITION_UNITS[form.unit("position")])
        return abs(math.log(max(ratio, 1e-30) / other))

    places = [form.unit("position")] if motion.by_fixes else POSITION_UNITS
    nearest = place, pace = min(product(places, SPEED_UNITS), key=off)
    if off(nearest) < SAME:
        cures = [f"--position-unit {place}"] * (place != form.unit("position"))
        cures += [f"--speed-unit {pace}"] * (pace != form.unit("speed"))
        yield f"{told}: another unit? {' '.join(cures)}"
        return
    if ratio < 1e-4 and np.nanmax(np.abs(motion.place_m)) <= 180.0:
        yield f"{told}: are they degrees? --lat COL --lon COL"
    else:
        power = math.log10(max(ratio, 1e-30))
        is_power = round(power) != 0 and math.log(10.0) * abs(power - round(power)) < JUST
        counts = f" are the times counts, to be multiplied by {10.0 ** round(power):g}," if is_power else ""
        yield f"{told}: are both units right,{counts} is the speed that of a wheel which slid?"


def backwards(motion: Motion) -> Iterator[str]:
    """A speed below 0 of which no positions along the track tell."""
    speed = motion.speed_mps[np.isfinite(motion.speed_mps)]
    if -speed.sum() > max(ONE_WAY * np.abs(speed).sum(), LEAST_M):
        yield "the speed is below 0: change its sign, it counts forward along the run"


def slow_or_falling(motion: Motion) -> Iterator[str]:
    """Positions alone: do they rise, and as fast as a train runs?"""
    course = motion.course_mps[np.isfinite(motion.course_mps)]
    if len(course) < LEAST_S:
        return
    most, is_steady = float(np.abs(course).max()), abs(course.sum()) > 0.8 * np.abs(course).sum()
    if is_steady and 0.0 < most < 2e-3:
        yield f"the train creeps at {most:.2g} m/s: are the positions degrees? --lat COL --lon COL"
    elif is_steady and 0.0 < most < 0.15:
        yield f"the train creeps at {most:.2g} m/s: are the positions in km? --position-unit km"
    else:
        yield from _against_chainage(motion, course[np.abs(course) > MOVES_MPS], LEAST_M)


def _against_chainage(motion: Motion, course: Array, least_m: float) -> Iterator[str]:
    """Whether the positions of a train that moves fall, or do both, by more than `least_m`."""
    way_m = np.abs(course).sum()
    fallen_m = -course[course < 0.0].sum()
    if fallen_m > max(ONE_WAY * way_m, least_m):
        first, last = motion.place_m[np.isfinite(motion.place_m)][[0, -1]]
        yield f"the positions fall, from {first:.6g} to {last:.6g} m: --direction down turns them"
    elif fallen_m > max((1.0 - ONE_WAY) * way_m, least_m):
        yield "the positions rise and fall: cut the log, and import the way back with --direction down"

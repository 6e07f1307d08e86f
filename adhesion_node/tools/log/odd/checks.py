# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is odd of a log as it was understood, each with the option that cures it.

Means over a second are judged, so that neither noise nor the rate of the rows matters.
"""

import math
from collections.abc import Iterator
from itertools import chain

import numpy as np

from ....core.physics.train import KMH, Array
from ....run.results.doubts import ABSOLUTE_PA
from ....run.results.seen import FASTEST_MPS
from ....wire.line import ATMOSPHERE_PA
from ..cell.numbers import has_dates
from ..format import PLACES, PRESSURE_UNITS, PRESSURES, TIME_UNITS, Format, option
from ..whole.clock import moment
from ..whole.moving import MOVES_MPS
from ..whole.read import Log
from .dropouts import dropouts
from .frozen import frozen
from .motion import BRAKES_MPS2, LEAST_M, LEAST_S, RUNS_MPS2, Motion, motion_of
from .seldom import seldom
from .sensors import felt, rolling, shifted, turning
from .sentinels import sentinels
from .ways import backwards, leaps, radians, slow_or_falling, speed_against_positions

HARDEST_MPS2, HARD_S = 3.0, 3
"""No train brakes harder for so many seconds: trams with track brakes reach 2.8 m/s^2."""

FAST_MPS, FAST_MPS2 = 45.0, 1.6
"""No train that is faster than the one brakes harder than the other."""

SLOWEST_ROWS_S, FASTEST_ROWS_S, USUAL_ROWS_S = 10.0, 5e-4, 0.3
"""Between two rows of a recorder."""

SILENT, WEAKEST_PA, FULL_PA = 0.1, 15e3, (5e4, 1.5e6)
"""Up to the first nothing is measured; no brake's greatest pressure is below the second, or above the third."""

HHMMSS = "--time-format %H%M%S where the times are hhmmss, %H%M%S.%f with a fraction"

PERCENT = 15.0, 120.0
"""What the greatest demand may be that is told in per cent of the full one."""

RELEASED_PIPE_PA = 2.5e5
"""No cylinder has so much while the train runs; the pipe has 5 bar then."""


def odd(log: Log) -> list[str]:
    """Say what is odd, with the cure."""
    t_s = (log.rows["t_ns"].to_numpy() - log.rows["t_ns"].iloc[0]) / 1e9
    stand_ins = [*sentinels(log)]
    of_time, texts = [*_rows_too_far(t_s, log.form)], [*_empty(log), *stand_ins, *dropouts(log)]
    texts += [*seldom(log, t_s), *_pressures(log)]
    if of_time or stand_ins or t_s[-1] < LEAST_S:
        return [*log.columns.doubts, *(of_time or _too_far(log, t_s)), *texts]
    of_way = [*leaps(log, t_s), *radians(log)]
    if not of_way and (froze := [*frozen(log, t_s)]):
        return [*log.columns.doubts, *texts, *froze]
    motion = motion_of(log, t_s)
    alone = () if motion.by_fixes else slow_or_falling(motion)
    of_way = of_way or [*(speed_against_positions(motion, log.form) if motion.is_compared else alone)]
    of_way = of_way or ([*backwards(motion)] if motion.by_fixes or not motion.is_compared else [])
    of_way = of_way or [*_too_fast(motion, log.form)] or [*_hard(motion, log.form)]
    return [
        *log.columns.doubts,
        *texts,
        *of_way,
        *_pipe(motion),
        *([*felt(motion, log.form)] or shifted(motion)),
        *rolling(motion, log.form),
        *turning(log, motion),
        *_clock(log, t_s),
        *_last(t_s),
    ]


def _rows_too_far(t_s: Array, form: Format) -> Iterator[str]:
    step_s = float(np.median(np.diff(t_s))) if len(t_s) > 2 else 1.0
    if form.time_unit in TIME_UNITS and not FASTEST_ROWS_S < step_s < SLOWEST_ROWS_S:
        of_unit = {unit: step_s * ns / TIME_UNITS[form.time_unit] for unit, ns in TIME_UNITS.items()}
        cure = min(of_unit, key=lambda unit: abs(math.log(max(of_unit[unit], 1e-30) / USUAL_ROWS_S)))
        other = {"excel": "days"}.get(cure, cure)
        yield f"a row every {step_s:.3g} s: are the times in {other}? --time-unit {cure}"


def _too_far(log: Log, t_s: Array) -> Iterator[str]:
    """Of a short log: the whole way is too long for the whole time."""
    place = log.rows["position"].dropna() if "position" in log.rows else log.rows["t_ns"][:0]
    way_m = abs(float(place.iloc[-1] - place.iloc[0])) if len(place) > 2 else 0.0
    if way_m > LEAST_M and way_m > FASTEST_MPS * t_s[-1]:
        yield f"{way_m:.4g} m in {t_s[-1]:.3g} s: another --time-unit, or --position-unit?"


def _pressures(log: Log) -> Iterator[str]:
    for name in ("brake_pressure", "brake_demand"):
        if name not in log.rows or name not in log.columns.names or not log.form.offset(name):
            continue
        gauge = log.rows[name] - log.form.ambient_pressure_pa
        least, most = gauge.min(), gauge.max()
        yield from _other_unit(name, most, log.form)
        if name == "brake_demand" and _is_share(log, most):
            yield "brake_demand goes up to 1: is it a share of a full brake? Name its column brake_demand [full]"
        if ABSOLUTE_PA[0] < least < ABSOLUTE_PA[1]:
            yield f"{name} never falls below {least / 1e5:.3g} bar: is it absolute? --pressure-kind absolute"

    if "brake_pipe" in log.columns.names and log.form.pipe_released is not None:
        released_pa = log.form.pipe_released * log.form.pascals("brake_pipe")
        yield from _other_unit("brake_pipe", released_pa, log.form)


def _is_share(log: Log, most_pa: float) -> bool:
    """Whether a demand up to 1 in its unit, which no header names, is far below what the cylinders get."""
    most = most_pa / log.form.pascals("brake_demand")
    told = "brake_demand" in log.form.told or "brake_pressure" not in log.rows
    return not told and abs(most - 1.0) < 1e-6 and log.rows["brake_pressure"].max() - ATMOSPHERE_PA > 2.0 * most_pa


def _other_unit(name: str, most_pa: float, form: Format) -> Iterator[str]:
    """A greatest pressure that no brake has: each unit in which it were one, with what it would be."""
    if SILENT < most_pa < WEAKEST_PA or most_pa > FULL_PA[1]:
        read_in = form.unit(name)
        most = most_pa / form.pascals(name)
        would_be = {unit: most * pa for unit, pa in PRESSURE_UNITS.items() if FULL_PA[0] < most * pa <= FULL_PA[1]}
        cures = "; ".join(f"--pressure-unit {unit}: {pa / 1e5:.2g} bar" for unit, pa in would_be.items())
        share = "percent" if PERCENT[0] < most < PERCENT[1] else "full"
        is_share = most_pa < WEAKEST_PA and (share == "percent" or most <= 1.0)
        cure = f"; or of a full brake? --pressure-unit {share}" if is_share else ""
        cure += "; or are they counts, of tenths? Divide them" if most_pa > FULL_PA[1] else ""
        units = " or ".join(would_be) or "another unit"
        yield f"{name} is {most:.6g} {read_in} at most: is it in {units}? {cures}{cure}"


def _empty(log: Log) -> Iterator[str]:
    for name in (*chain.from_iterable(PLACES), *PRESSURES):
        if name in log.rows and log.rows[name].isna().all():
            yield f"no row has a {name}: name another column with {option(name)} COL"


def _hard(motion: Motion, form: Format) -> Iterator[str]:
    """Without positions only the braking tells of a wrong unit of the speed."""
    steps = (motion.speed_mps[HARD_S:] - motion.speed_mps[:-HARD_S]) / HARD_S
    slows_fast = motion.slows_mps2[np.abs(motion.speed_mps) > FAST_MPS] < -FAST_MPS2
    hardest = float(np.nanmin(np.concatenate([steps, motion.slows_mps2]), initial=0.0))
    if np.nanmin(steps, initial=0.0) < -HARDEST_MPS2 or slows_fast.any():
        unit = "km/h read as m/s, --speed-unit kmh? Or " if form.unit("speed") == "mps" else ""
        other = "is it of a wheel that locked, or do numbers stand for no value? Leave those cells empty"
        yield f"the speed falls by {-hardest:.1f} m/s^2, harder than any train brakes: {unit}{other}"


def _too_fast(motion: Motion, form: Format) -> Iterator[str]:
    speeds = np.sort(motion.fastest_mps[np.isfinite(motion.fastest_mps)])
    if len(speeds) > 2 and (fast := float(speeds[-3])) > FASTEST_MPS:  # two seconds may be outliers
        measured = bool(np.isfinite(motion.speed_mps).any())
        unit = "km/h? --speed-unit kmh" if form.unit("speed") == "mps" else "another --speed-unit?"
        cure = unit if measured else "another --position-unit, --time-unit?"
        yield f"the train runs {fast:.0f} m/s, {fast / KMH:.0f} km/h: {cure}"


def _pipe(motion: Motion) -> Iterator[str]:
    """The pressure of a cylinder rises when the train brakes, that of the pipe falls; it stands braked as well."""
    slows, moves = motion.slows_mps2, motion.fastest_mps > MOVES_MPS
    known = np.isfinite(motion.pressure_pa)
    braking, running = (
        motion.pressure_pa[known & (slows < BRAKES_MPS2)],
        motion.pressure_pa[known & moves & (slows > RUNS_MPS2)],
    )
    if len(braking) > 2 and len(running) > 2:
        brakes_pa, runs_pa = np.median(braking), np.median(running)
        if runs_pa > RELEASED_PIPE_PA and brakes_pa < runs_pa - 0.2e5:
            yield (
                f"brake_pressure is {runs_pa / 1e5:.1f} bar while the train runs, {brakes_pa / 1e5:.1f} bar while it "
                "brakes: is it the brake pipe's? --pipe COL"
            )


def _last(t_s: Array) -> Iterator[str]:
    """One row that is later than all others by more than the whole log."""
    if len(t_s) > LEAST_S and (late_s := float(t_s[-1] - t_s[-2])) > t_s[-2]:
        yield f"the last row is {late_s:.4g} s later than the one before: are its numbers totals? Leave it out"


def _clock(log: Log, t_s: Array) -> Iterator[str]:
    """Time that goes on by much more than the train's way: a clock that was set."""
    if "position" not in log.rows:
        return
    known = log.rows["position"].notna().to_numpy()
    at, place, t_ns = t_s[known], log.rows["position"].to_numpy()[known], log.rows["t_ns"].to_numpy()[known]
    steps = np.diff(at)
    for i in np.flatnonzero(steps > max(LEAST_S, 50.0 * np.median(steps) if len(steps) else 0.0)):
        before, after = (
            np.abs(place[b] - place[a]) / max(at[b] - at[a], 1e-9)
            for a, b in ((max(i - 5, 0), i), (i + 1, min(i + 6, len(at) - 1)))
        )
        slowest = min(before, after)
        if slowest > 5.0 and abs(place[i + 1] - place[i]) < 0.5 * slowest * steps[i]:
            is_date = has_dates(log.form) and log.form.time_zone == "UTC"
            cure = "--time-zone where summer time began, else " if is_date and abs(steps[i] - 3600.0) < LEAST_S else ""
            cure += f"{HHMMSS}, else " if not is_date and round(steps[i] - np.median(steps)) in (40, 4040) else ""
            yield (
                f"the clock goes on by {steps[i]:.0f} s at {moment(t_ns[i])} and the train does not: "
                f"{cure}cut the log there, or correct the times behind"
            )
            return

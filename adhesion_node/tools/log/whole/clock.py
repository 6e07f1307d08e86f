# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The times of a log: of a clock that goes on after midnight, written in digits alone, or in a zone."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd

from ....core.physics.train import Array
from ..cell.numbers import END_OF_STAMPS_NS, has_dates, is_clock
from ..format import TIME_UNITS, Format

DAY_NS, S = 86_400 * 10**9, 10**9

REGULAR = 5.0
"""Usual steps up to which a row is missing at most where a counter begins anew."""


def in_digits(rows: pd.DataFrame, form: Format, asked: Format) -> tuple[pd.DataFrame, Format, list[str]]:
    """The times of numbers that are hhmmss, as NMEA has them: no minute has more than 60 s, and none of 40 is missing.

    As seconds they would go on by 40 s whenever a minute begins; `asked` is the format with what is open.
    """
    t_ns = rows["t_ns"].to_numpy()
    hours, minutes, seconds = t_ns // (10_000 * S), t_ns // (100 * S) % 100, t_ns // S % 100
    is_clock_time = bool(((hours < 24) & (minutes < 60) & (seconds < 60)).all())
    if asked.time_unit is not None or (form.time_format, form.time_unit) != (None, "s") or not is_clock_time:
        return rows, form, []
    of_day_ns = ((hours * 60 + minutes) * 60 + seconds) * S + t_ns % S
    steps, of_day_steps = np.diff(t_ns), np.diff(of_day_ns) % DAY_NS
    begins = steps != of_day_steps
    if not begins.any() or begins.all() or np.median(of_day_steps[begins]) > 3 * np.median(steps[~begins]):
        return rows, form, []
    note = "time: hhmmss, as no minute has more than 60 s; --time-unit s says otherwise"
    return rows.assign(t_ns=of_day_ns), replace(form, time_format="%H%M%S.%f", time_unit=None), [note]


def going_on(rows: pd.DataFrame, form: Format) -> tuple[pd.DataFrame, list[str]]:
    """The times of a clock go on after midnight, or the hour, and those of a counter where it begins anew."""
    t_ns = rows["t_ns"].to_numpy()
    steps = np.diff(t_ns)
    if form.sort or has_dates(form) or not (steps < 0).any():
        return rows, []
    if is_clock(form.time_format):
        period_ns = DAY_NS if re.search("%[HIXT]", form.time_format or "") else 3600 * S
        begins, notes = steps < -period_ns / 2, []
    else:
        begins, period_ns = steps < 0, _period_ns(steps, TIME_UNITS[form.time_unit or "s"])
        notes = [f"time: a counter up to {period_ns / S:.10g} s began anew: it goes on"] * (period_ns > 0)
    return rows.assign(t_ns=t_ns + period_ns * np.append(0, np.cumsum(begins))), notes


def _period_ns(steps: Array, unit_ns: int) -> int:
    """After what a counter began anew, so that no step is longer than `REGULAR` usual ones; 0 for nothing known."""
    longest = REGULAR * float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    periods = (DAY_NS, 7 * DAY_NS, *(2**bits * unit_ns for bits in (16, 31, 32)))
    behind = {period: steps[steps < 0] + period for period in periods if period < END_OF_STAMPS_NS}
    return next((period for period, each in behind.items() if ((each > 0) & (each <= longest)).all()), 0)


def in_zone(rows: pd.DataFrame, form: Format) -> tuple[pd.DataFrame, list[str], list[str]]:
    """The times of a zone as UTC, what was done, and what is odd.

    Of an hour that is there twice, where the rows do not tell, it is that which joins them; one that is not there is
    that of a clock without summer time, which goes on by an hour less.
    """
    if form.time_zone == "UTC" or not has_dates(form):
        return rows, [], []
    local, zone, missing = pd.DatetimeIndex(rows["t_ns"].to_numpy()), form.time_zone, pd.Timedelta(hours=1)
    try:
        utc = local.tz_localize(zone, ambiguous="infer", nonexistent=missing)
    except Exception:  # an hour that is there twice; of pandas before 3 no ValueError. What else is wrong fails again
        either = (np.full(len(local), summer) for summer in (True, False))
        both = [local.tz_localize(zone, ambiguous=summer, nonexistent=missing) for summer in either]
        utc = min(both, key=lambda each: np.max(np.abs(np.diff(each.asi8)), initial=0))
    rows["t_ns"] = utc.as_unit("ns").asi8
    is_none = utc.tz_localize(None) != local
    odd = [_no_such_time(local[is_none], zone)] if is_none.any() else []
    return rows, [f"time: local of {zone}"], odd


def _no_such_time(local: pd.DatetimeIndex, zone: str) -> str:
    """Say that times are not there in a zone, and which has them: the one without summer time."""
    winter_h = (local[0] - pd.Timedelta(days=1)).tz_localize(zone).utcoffset() / pd.Timedelta(hours=1)
    fixed = f"Etc/GMT{-winter_h:+.0f}" if winter_h == round(winter_h) else "the zone without it"
    return (
        f"{len(local)} rows from {local[0]} on are at times that {zone} has not, as summer time begins: has the clock "
        f"none? --time-zone {fixed}"
    )


def moment(t_ns: int) -> str:
    """Write a time: seconds, or a date where it is one.

    >>> moment(1_500_000_000), moment(1_700_000_000_000_000_000)
    ('1.5 s', '2023-11-14T22:13:20')
    """
    return f"{t_ns / 1e9:.9g} s" if t_ns < 10**17 else pd.Timestamp(t_ns).isoformat()

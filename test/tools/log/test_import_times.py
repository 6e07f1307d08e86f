# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Times of logs as recorders write them: numbers, dates, clocks, zones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import ride, text

from adhesion_node.wire.topics import SPEED

__all__ = ["importing"]

S = 10**9


@pytest.mark.parametrize(
    ("written", "options", "first_ns"),
    [
        ("%H:%M:%S,%f", [], 29_703 * S),
        ("%d.%m.%Y %H:%M:%S", [], 1_732_176_903 * S),
        ("%d.%m.%Y %H:%M:%S,%f", ["--time-zone", "Europe/Berlin"], (1_732_176_903 - 3600) * S),
        ("%d.%m.%y %H:%M:%S.%f", [], 1_732_176_903 * S),
        ("%m/%d/%Y %H:%M:%S", [], 1_732_176_903 * S),
        ("%Y-%m-%dT%H:%M:%S.%fZ", ["--time-zone", "Europe/Berlin"], 1_732_176_903 * S),
        ("%Y-%m-%d %H:%M:%S", [], 1_732_176_903 * S),
        ("%m/%d/%Y %I:%M:%S %p", [], 1_732_176_903 * S),
        ("%m/%d/%Y %I:%M:%S.%f %p", [], 1_732_176_903 * S),
        ("%d-%b-%y %H:%M:%S", [], 1_732_176_903 * S),
        ("%d-%b-%Y %H:%M:%S.%f", [], 1_732_176_903 * S),
        ("%d %b %Y %H:%M:%S.%f", [], 1_732_176_903 * S),
        ("%b %d, %Y %I:%M:%S %p", [], 1_732_176_903 * S),
        ("%m/%d/%y %H:%M:%S", [], 1_732_176_903 * S),
        ("%d/%m/%y %H:%M:%S,%f", [], 1_732_176_903 * S),
        ("%d.%m.%Y, %H:%M:%S", [], 1_732_176_903 * S),
        ("%Y-%m-%d %H:%M:%S.%f UTC", ["--time-zone", "Europe/Berlin"], 1_732_176_903 * S),
        ("%d.%m.%Y %H:%M:%S GMT", ["--time-zone", "Europe/Berlin"], 1_732_176_903 * S),
        ("%M:%S.%f", [], 903 * S),
        ("%d.%m.%Y %H:%M:%S:000", [], 1_732_176_903 * S),
        ("%H:%M:%S:000", [], 29_703 * S),
        ("%Hh%Mm%S %d-%b-%Y", ["--time-format", "%Hh%Mm%S %d-%b-%Y"], 1_732_176_903 * S),
    ],
)
def test_times_as_recorders_write_them(importing: Import, written: str, options: list[str], first_ns: int) -> None:
    moments = pd.Timestamp("2024-11-21 08:15:03") + pd.to_timedelta(range(30), unit="s")
    rows = ride()[: 10 * len(moments) : 10].assign(time=moments.strftime(written))
    assert importing(text(rows, ";"), *options) == 0, importing.errors
    assert [sample.t_ns for sample in importing.positions()] == [first_ns + i * S for i in range(30)]


@pytest.mark.parametrize(
    "written",
    [
        *(str, lambda span: str(span.to_pytimedelta())),
        *(pd.Timedelta.isoformat, lambda span: f"PT{span.total_seconds():.1f}S"),
    ],
)
def test_durations_as_programs_write_them(importing: Import, written: Callable[[pd.Timedelta], str]) -> None:
    """Across midnight, and a gap of days."""
    spans = pd.to_timedelta([86_390.0 + 0.5 * i + 3 * 86_400 * (i > 25) for i in range(30)], unit="s")
    assert importing(text(ride()[:30].assign(time=list(map(written, spans))), ";")) < 2, importing.errors
    assert [sample.t_ns for sample in importing.positions()] == spans.as_unit("ns").asi8.tolist()


@pytest.mark.parametrize(
    ("day", "clock", "options"),
    [
        ("%d.%m.%Y", "%H:%M:%S,%f", []),
        ("%m/%d/%y", "%I:%M:%S %p", []),
        ("%Y-%m-%d", "%H:%M:%S.%f", ["--time-zone", "UTC"]),
        ("%d%m%y", "%H%M%S", ["--date", "date", "--time-format", "%d%m%y %H%M%S"]),
    ],
)
def test_a_date_in_a_column_of_its_own_is_that_of_the_time(
    importing: Import, day: str, clock: str, options: list[str]
) -> None:
    moments = pd.Timestamp("2024-11-21 23:59:50") + pd.to_timedelta(range(20), unit="s")
    rows = ride()[:200:10].assign(time=moments.strftime(clock), Date=moments.strftime(day))
    assert importing(text(rows, ";"), *options) == 0, importing.errors
    assert [sample.t_ns for sample in importing.positions()] == moments.as_unit("ns").asi8.tolist()


@pytest.mark.parametrize(
    ("clock", "date"), [("%H:%M:%S", "of a Thursday"), ("%Y-%m-%d %H:%M:%S", "2020-01-01"), ("%H:%M:%S", "17")]
)
def test_a_column_that_is_no_date_of_the_time_is_not_read(importing: Import, clock: str, date: str) -> None:
    moments = pd.Timestamp("2024-11-21 08:15:03") + pd.to_timedelta(range(20), unit="s")
    assert importing(text(ride()[:200:10].assign(time=moments.strftime(clock), date=date))) == 0, importing.errors
    first_ns = importing.positions()[0].t_ns
    assert first_ns == (29_703 * S if clock == "%H:%M:%S" else 1_732_176_903 * S)


@pytest.mark.parametrize(("unit", "per_s"), [("s", 1), ("ms", 10**3), ("us", 10**6), ("ns", 10**9)])
def test_times_since_1970_tell_their_unit(importing: Import, unit: str, per_s: int) -> None:
    begin = 1_732_176_903
    assert importing(f"time,speed\n{begin * per_s},1\n{(begin + 1) * per_s},1\n") == 0
    assert [SPEED.read(message).t_ns for message in importing.messages("speed")] == [begin * S, (begin + 1) * S]


def test_a_time_that_is_written_in_no_known_way_is_told_with_the_option(importing: Import) -> None:
    log = "time,speed\n8:15:03 o'clock,1\n8:15:04 o'clock,1\n"
    assert importing(log) == 2
    assert "say how with --time-format" in importing.errors[0]
    assert importing(log, "--time-format", "%H:%M:%S o'clock") == 0


def test_the_days_of_a_spreadsheet(importing: Import) -> None:
    rows = ride()
    log = text(rows.assign(time=45617.34378472 + rows.time / 86400.0))
    assert importing(log) == 1
    assert "are the times in days? --time-unit excel" in importing.errors[0]
    importing.output = importing.output.with_name("cured")
    assert importing(log, "--time-unit", "excel") == 0
    first, *_, last = (sample.t_ns for sample in importing.positions())
    assert first == pytest.approx(1_732_176_903 * S, abs=S / 100)
    assert last - first == pytest.approx(59.9 * S, abs=S / 100)


def test_a_part_of_the_day_is_a_time(importing: Import) -> None:
    assert importing(text(ride().assign(time=0.25 + ride().time / 86_400.0)), "--time-unit", "excel") == 0
    assert [sample.t_ns for sample in importing.positions()][:2] == pytest.approx([21_600 * S, 21_600 * S + S // 10])


def test_a_date_in_digits_alone_is_told(importing: Import) -> None:
    log = "time,speed\n20241121085940,1\n20241121085941,1\n"
    assert importing(log) == 2
    assert importing.errors[0].endswith("is the --time-unit another? Or --time-format %Y%m%d%H%M%S?")
    assert importing(log, "--time-format", "%Y%m%d%H%M%S") == 0


def test_a_clock_of_whole_seconds_is_told(importing: Import) -> None:
    rows = ride()
    assert importing(text(rows.assign(time=rows.time.astype(int)))) == 1
    assert importing.errors[0].endswith("rows share a time: log it with the fraction of the second")
    assert importing.summary["written"] == 60


def test_the_end_of_summer_time_is_no_step_of_the_clock(importing: Import) -> None:
    """At 3 o'clock it is 2 o'clock again."""
    log = "time,speed\n27.10.2024 02:59:58,1\n27.10.2024 02:59:59,1\n27.10.2024 02:00:00,1\n27.10.2024 02:00:01,1\n"
    assert importing(log, "--time-zone", "Europe/Berlin") == 0
    assert np.diff([SPEED.read(message).t_ns for message in importing.messages("speed")]).tolist() == [S] * 3


@pytest.mark.parametrize("written", ["%H%M%S.%f", "%H%M%S"])
@pytest.mark.parametrize("begin", ["08:15:33", "12:59:30", "23:59:30"])
def test_digits_of_a_clock_are_no_seconds(importing: Import, begin: str, written: str) -> None:
    """As of NMEA: 081559 is followed by 081600."""
    moments = pd.Timestamp(f"2024-11-21 {begin}") + pd.to_timedelta(range(150), unit="s")
    rows = pd.DataFrame({"time": moments.strftime(written), "position": 40.0 * np.arange(150) + 1000.0})
    assert importing(text(rows)) == 0, importing.errors
    of_day_s = (pd.Timestamp(f"1970-01-01 {begin}") - pd.Timestamp(0)).total_seconds()
    assert [sample.t_ns / S for sample in importing.positions()] == [of_day_s + i for i in range(150)]
    importing.output = importing.output.with_name("seconds")
    importing(text(rows), "--time-unit", "s")
    told = "--time-format %H%M%S where the times are hhmmss, %H%M%S.%f with a fraction" in str(importing.errors)
    assert told == (begin == "12:59:30"), "a step of 40 s is none among rows of a second"
    importing.output = importing.output.with_name("format")
    assert importing(text(rows), "--time-format", written) == 0


@pytest.mark.parametrize(
    "times", [range(200), range(1000, 1060), [*range(1000, 1060), *range(1100, 1130)], range(81530, 81730)], ids=str
)
def test_seconds_are_no_digits_of_a_clock(importing: Import, times: list[int]) -> None:
    importing("time,speed\n" + "".join(f"{time},20\n" for time in times))
    expected = list(times)
    if expected[-1] == 1129:  # 16:59 is followed by 11:00
        expected = [*range(600, 690)]
    assert [SPEED.read(message).t_ns // S for message in importing.messages("speed")] == expected


@pytest.mark.parametrize(
    ("written", "options"),
    [
        ("2024-11-21 08:15:0{}+01", ()),
        ("2024-11-21T08:15:0{}+0100", ()),
        ("2024-11-21 08:15:0{}.5+01:00", ()),
        ("21.11.2024 08:15:0{} +0100", ("--time-format", "%d.%m.%Y %H:%M:%S %z")),
    ],
)
def test_a_date_that_names_its_zone_is_in_no_other(importing: Import, written: str, options: tuple[str, ...]) -> None:
    rows = "".join(f"{written.format(second)},{second}\n" for second in range(3))
    assert importing(f"time,position\n{rows}", "--time-zone", "America/New_York", *options) == 0
    begins = pd.Timestamp(importing.positions()[0].t_ns).floor("s")
    assert begins == pd.Timestamp("2024-11-21 07:15:00")


@pytest.mark.parametrize("zone", [" CET", " Europe/Berlin", "[Europe/Berlin]"])
def test_of_a_zone_by_its_name_the_remedy_is_told(importing: Import, zone: str) -> None:
    log = f"time,position\n2024-11-21 00:00:00{zone},1\n2024-11-21 00:00:01{zone},2\n"
    assert importing(log) == 2
    behind = f"; with {zone!r} at its end, and the zone by --time-zone, such as Europe/Berlin"
    assert importing.errors[0].endswith(behind)
    assert importing(log, "--time-format", f"%Y-%m-%d %H:%M:%S{zone}", "--time-zone", "Europe/Berlin") == 0
    assert pd.Timestamp(importing.positions()[0].t_ns) == pd.Timestamp("2024-11-20 23:00:00")


@pytest.mark.parametrize("year", [1900, 1904])
def test_of_seconds_since_another_year_what_to_subtract_is_told(importing: Import, year: int) -> None:
    since = (pd.Timestamp("2024-11-21") - pd.Timestamp(f"{year}-01-01")).total_seconds()
    assert importing(f"time,position\n{since:.1f},1\n{since + 1:.1f},2\n") == 2
    less = (pd.Timestamp("1970-01-01") - pd.Timestamp(f"{year}-01-01")).total_seconds()
    assert f"{year}" in importing.errors[0]
    assert f" {less:.0f}" in importing.errors[0]


def test_a_date_without_a_zone_is_in_the_one_that_is_told(importing: Import) -> None:
    log = "time,position\n2024-11-21 00:00:00,1\n2024-11-21 00:00:01,2\n"
    assert importing(log, "--time-zone", "Europe/Berlin") == 0
    assert pd.Timestamp(importing.positions()[0].t_ns) == pd.Timestamp("2024-11-20 23:00:00")


def test_a_clock_without_summer_time_is_told(importing: Import) -> None:
    """In Berlin summer time began at 2 on 31 March 2024."""
    moments = pd.Timestamp("2024-03-31 01:59:30") + pd.to_timedelta(ride().time, unit="s")
    assert importing(text(ride().assign(time=moments)), "--time-zone", "Europe/Berlin") == 1
    stamps = (moments - pd.Timedelta(hours=1)).array.as_unit("ns").asi8.tolist()
    assert [sample.t_ns for sample in importing.positions()] == stamps
    assert importing.summary["odd"] == [
        "300 rows from 2024-03-31 02:00:00 on are at times that Europe/Berlin has not, as summer time begins: has the "
        "clock none? --time-zone Etc/GMT-1"
    ]
    importing.output = importing.output.with_name("fixed")
    assert importing(text(ride().assign(time=moments)), "--time-zone", "Etc/GMT-1") == 0
    assert [sample.t_ns for sample in importing.positions()] == stamps


@pytest.mark.parametrize(("begins", "utc"), [("02:59:30", "01:59:30"), ("01:59:30", "23:59:30")])
def test_the_hour_that_is_there_twice_joins_the_rows(importing: Import, begins: str, utc: str) -> None:
    """In Berlin summer time ended at 3 on 27 October 2024."""
    times = pd.to_datetime(f"2024-10-27 {begins}") + pd.to_timedelta(np.arange(60), unit="s")
    rows = "".join(f"{time},{30.0 * index}\n" for index, time in enumerate(times.strftime("%Y-%m-%d %H:%M:%S")))
    assert importing(f"time,position\n{rows}", "--time-zone", "Europe/Berlin") == 0
    stamps = [each.t_ns for each in importing.positions()]
    assert np.ptp(np.diff(stamps)) == 0
    assert str(pd.Timestamp(stamps[0]).time()) == utc


def test_a_date_that_looks_like_no_date_is_cured_by_its_format(importing: Import) -> None:
    log = "time,speed\n20241121 081503.5,1\n20241121 081504.5,2\n"
    assert importing(log) == 2
    assert importing.errors[0].endswith("a date is told by --time-format")
    assert importing(log, "--time-format", "%Y%m%d %H%M%S.%f") == 0
    assert SPEED.read(importing.messages("speed")[0]).t_ns == 1_732_176_903_500_000_000


@pytest.mark.parametrize(
    "time", ["20241121T081503.5Z", "20241121T091503.5+0100", "2024-11-21T081503.5z", "2024-11-21t08:15:03.5z"]
)
def test_a_date_of_iso_needs_no_colons_nor_capitals(importing: Import, time: str) -> None:
    assert importing(f"time,speed\n{time},1\n{time.replace('03.5', '04.5')},2\n") == 0, importing.errors
    assert SPEED.read(importing.messages("speed")[0]).t_ns == 1_732_176_903_500_000_000

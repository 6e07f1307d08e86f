# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is odd of the way of a train is said: there and back, long stops, steps of the clock, places that jump."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import ride, text

__all__ = ["importing"]


def test_a_speed_against_the_positions_is_said(importing: Import) -> None:
    """Positions of a falling chainage are turned, speeds are not: they count forward along the run."""
    assert importing(text(ride().assign(speed=-ride().speed))) == 1
    (said,) = importing.errors
    assert "the speed is below 0 while the positions rise: change its sign" in said


def test_the_speed_of_a_step_of_the_clock_is_said(importing: Import) -> None:
    rows = ride()
    rows.loc[rows.time > 10.0, "time"] += 3600.0
    assert importing(text(rows)) == 1
    assert "the clock goes on by 3600 s at 10 s and the train does not" in importing.errors[0]
    late = ride()
    late.loc[late.time > 10.0, "time"] -= 5.0
    importing.output = importing.output.with_name("back")
    assert importing(text(late)) == 1
    assert "the clock was set back, or a counter began anew: add to the times behind what they" in importing.errors[0]
    assert "--time-zone" not in importing.errors[0], "which is refused for times without a date"


@pytest.mark.parametrize("every", [1, 15, 20, 50])
def test_a_recorder_slower_than_a_second_is_judged_alike(importing: Import, every: int) -> None:
    """Every 2 s nothing was said, every 1.5 s a good log was to be in mph, every 5 s the speed fell by nan."""
    rows = ride().assign(speed=lambda rows: rows.speed + 0.1 * np.sin(rows.time))[::every]
    for wrong, cure in (
        ({}, ""),
        ({"speed": 3.6 * rows.speed}, "--speed-unit kmh"),
        ({"position": rows.position / 1e3}, "--position-unit km"),
        ({"position": 9e3 - rows.position}, "--direction down"),
    ):
        importing.output = importing.output.with_name(f"in {cure}")
        assert importing(text(rows.assign(**wrong))) == bool(cure), importing.errors
        assert [cure in odd for odd in importing.summary["odd"]] == [True] * bool(cure), importing.summary["odd"]


def test_places_that_come_more_seldom_than_speeds_are_compared(importing: Import) -> None:
    rows = ride().assign(speed=lambda rows: 3.6 * rows.speed)
    assert importing(text(rows.assign(position=rows.position.where(rows.index % 50 == 0)))) == 1
    assert [odd for odd in importing.summary["odd"] if odd.endswith("another unit? --speed-unit kmh")]


@pytest.mark.parametrize(("counts", "unit", "cure"), [(10, "s", 0.1), (100, "ms", 10), (3, "s", None)])
def test_times_that_count_other_steps_are_said(importing: Import, counts: int, unit: str, cure: float | None) -> None:
    """Tenths of a second as s, and the ticks of 10 ms of an event recorder as ms; a third is no count."""
    t_s = np.arange(0.0, 300.0, 0.2)
    rows = pd.DataFrame({"time": counts * t_s, "position": 15.0 * t_s, "speed": 15.0 + 0.1 * np.sin(t_s)}).round(3)
    assert importing(text(rows), "--time-unit", unit) == 1
    told = next(odd for odd in importing.summary["odd"] if odd.startswith("the positions move at "))
    assert (f" are the times counts, to be multiplied by {cure}, " in told) == (cure is not None)


def test_there_and_back_is_said(importing: Import) -> None:
    there = ride()
    back = there.assign(time=there.time + 60.0, position=there.position.iloc[-1] - there.position + 1000.0)
    assert importing(text(pd.concat([there, back]))) == 1
    assert "the positions rise and fall: cut the log" in importing.errors[0]
    assert len(importing.errors) == 1, "their speed is right all the same"


def test_a_train_that_stands_for_long_is_not_odd(importing: Import) -> None:
    rows = ride(82)
    stands = pd.DataFrame({"time": 90.0 + np.arange(6000) / 10.0})
    noise = np.random.default_rng(1).normal(0.0, 1.0, len(stands))
    stands = stands.assign(position=rows.position.iloc[-1] + noise, speed=0.0, brake_pressure=3e5)
    assert importing(text(pd.concat([rows, stands]))) == 0, importing.errors


@pytest.mark.parametrize("stands_s", [60, 600])
@pytest.mark.parametrize("drop", ["position", "speed"])
def test_the_pipe_of_a_train_that_stands_longer_than_it_runs_is_told(
    importing: Import, stands_s: int, drop: str
) -> None:
    """It stands braked: by all the time that it does not brake the pipe would seem to be low where the train runs."""
    rows = ride(82)
    stands = pd.DataFrame({"time": 82.0 + np.arange(10 * stands_s) / 10.0, "brake_pressure": 3e5, "speed": 0.0})
    rows = pd.concat([rows, stands.assign(position=rows.position.iloc[-1])])
    noise = np.random.default_rng(1).normal(0.0, 0.5, len(rows))
    rows = rows.assign(brake_pressure=5e5 - rows.brake_pressure / 2, position=rows.position + noise)
    assert importing(text(rows.drop(columns=drop))) == 1
    assert [odd for odd in importing.summary["odd"] if "5.0 bar while the train runs" in odd and "--pipe" in odd]


def test_a_stop_of_ten_minutes_without_rows_is_no_step_of_the_clock(importing: Import) -> None:
    rows = ride(89)
    rows = pd.concat([rows, ride().assign(time=rows.time + 700.0, position=rows.position.iloc[-1] + ride().position)])
    assert importing(text(rows)) == 0, importing.errors


@pytest.mark.parametrize("drop", [[], ["speed"]])
@pytest.mark.parametrize(("ends_m", "times"), [(3000.0, ""), (1100.0, ", 3 times so")])
def test_an_odometer_that_begins_anew_is_no_way_back(
    importing: Import, ends_m: float, times: str, drop: list[str]
) -> None:
    rows = ride()
    assert importing(text(rows.assign(position=rows.position % ends_m).drop(columns=drop))) == 1
    (odd,) = importing.summary["odd"]
    assert odd.startswith("the positions fall at once from ")
    assert f"{times}: an odometer that begins anew: cut the log there, or add to what is behind what it fell by" in odd


def test_a_column_of_several_quantities_is_no_way(importing: Import) -> None:
    """A signal to a row, as buses are logged: `value` is the speed in every second one."""
    rows = ride().melt("time", ["position", "speed"]).sort_values("time", kind="stable")
    rows["time"] += (rows.variable == "speed") * 0.03
    assert importing(text(rows), "--position", "value") == 1
    (odd,) = importing.summary["odd"]
    assert odd.endswith("row by row: are several quantities in one column? Give each its own")


def test_a_place_that_jumps_there_and_back_is_no_reset(importing: Import) -> None:
    rows = ride()
    importing(text(rows.assign(position=rows.position.where(rows.index % 50 != 7, 0.0))))
    assert "odometer" not in str(importing.summary["odd"])


def test_speeds_of_two_trains_are_none_of_one(importing: Import) -> None:
    rows = ride().drop(columns="position")
    other = rows.assign(time=rows.time + 0.05, speed=rows.speed / 2.0)
    assert importing(text(pd.concat([rows, other]).sort_values("time"))) == 1
    (odd,) = importing.summary["odd"]
    assert odd == "the speeds leap there and back row by row: are several quantities in one column? Give each its own"


@pytest.mark.parametrize("by_fix", [False, True])
def test_a_speed_below_0_without_a_chainage_is_said(importing: Import, by_fix: bool) -> None:
    rows = ride().assign(speed=-ride().speed)
    fixes = rows.assign(lat=47.0 + rows.position / 111_181.0, lon=8.0) if by_fix else rows
    assert importing(text(fixes.drop(columns="position"))) == 1
    assert importing.summary["odd"] == ["the speed is below 0: change its sign, it counts forward along the run"]

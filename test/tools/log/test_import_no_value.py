# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Numbers that stand for no value: far from all others, or such as no train has; what many rows have is one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import ride, text

from adhesion_node.tools.log.cell.marks import marks

__all__ = ["importing"]


def test_a_number_that_no_product_holds_is_none_of_them() -> None:
    """numpy warned of the overflow on the user's terminal."""
    with np.errstate(over="raise"):
        assert marks(np.array([1e308, -9999.0])).tolist() == [False, True]


@pytest.mark.parametrize(
    ("column", "mark"),
    [("position", -9999), ("position", 0), ("brake_pressure", -999), ("speed", 9999)],
)
def test_a_number_that_stands_for_no_value_is_said(importing: Import, column: str, mark: float) -> None:
    rows = ride().drop(columns="position" if column == "speed" else "speed")
    written = rows.assign(position=rows.get("position", rows.time) + 119_000.0) if column != "speed" else rows
    gaps = (rows.index % 10 == 3) | ((rows.index > 100) & (rows.index < 150))
    importing(text(written.assign(**{column: written[column].mask(gaps, mark)})))
    told = f"{column} is {mark:g} in {gaps.sum()} rows, far from all others: no value? Leave those cells empty"
    assert importing.summary["odd"] == ([told] if column != "speed" else []), "no train has such a speed: refused"
    importing.output = importing.output.with_name("cured")
    importing(text(written.assign(**{column: written[column].mask(gaps)})))
    assert importing.summary["odd"] == []


@pytest.mark.parametrize("drop", [[], ["position"]], ids=str)
@pytest.mark.parametrize(("column", "mark"), [("speed", 0), ("speed", -1), ("position", -1)])
def test_a_number_to_which_no_train_leaps_stands_for_no_value(
    importing: Import, column: str, mark: float, drop: list[str]
) -> None:
    rows = ride()
    gaps = rows.index % 7 == 3
    importing(
        text(rows.assign(**{column: rows[column].mask(gaps, mark)}).drop(columns=drop if column == "speed" else []))
    )
    told = f"{column} is {mark:g} in {gaps.sum()} rows, far from all others: no value? Leave those cells empty"
    assert importing.summary["odd"] == [told]


@pytest.mark.parametrize(
    ("column", "mark", "options"),
    [
        *(("speed", mark, []) for mark in (-9999, -999, 9999, 65535, 32767, 6553.5, 4294967295)),
        ("speed", 999999, ["--speed-unit", "kmh"]),
        ("brake_pressure", -9999, ["--pressure-unit", "kpa"]),
        ("wheel_speed_1", -32768, []),
        ("acceleration", 3276.7, []),
    ],
)
def test_a_number_that_no_train_has_and_that_stands_for_no_value_is_named(
    importing: Import, column: str, mark: float, options: list[str]
) -> None:
    """The unit is right: what helps is an empty cell, of which the rest of the row is read."""
    rows = ride().assign(wheel_speed_1=ride().speed / 0.46, acceleration=0.0, brake_pressure=3.0)[:190]
    gaps = rows.index % 10 == 3
    importing(text(rows.assign(**{column: rows[column].mask(gaps, mark)})), *options)
    assert importing.errors[0].startswith(
        f"import_csv: FILE:5: {column} = '{float(mark)}': it stands for no value: leave"
    )
    assert importing.summary["refused"] == {"no_value": gaps.sum()}
    importing.output = importing.output.with_name("cured")
    importing(text(rows.assign(**{column: rows[column].mask(gaps)})), *options)
    assert (importing.summary["refused"], importing.summary["empty"]) == ({}, {column: gaps.sum()})


@pytest.mark.parametrize("mark", [655.35, 327.67])
def test_the_end_of_an_integer_of_hundredths_is_no_speed(importing: Import, mark: float) -> None:
    rows = ride().assign(speed=3.6 * ride().speed).drop(columns="position")
    importing(text(rows.assign(speed=rows.speed.mask(rows.index % 10 == 3, mark))), "--speed-unit", "kmh")
    assert f"speed is {mark:g} in 60 rows, far from all others: no value? Leave" in str(importing.summary["odd"])


@pytest.mark.parametrize(
    "change",
    [
        lambda rows: rows.assign(acceleration=np.where(rows.time < 20.0, 0.0, -0.8 + 0.01 * np.sin(rows.time))),
        lambda rows: rows.assign(brake_pressure=np.where(rows.time < 20.0, 0.0, 3e5 + rows.time)),
        lambda rows: rows.assign(brake_pressure=rows.brake_pressure - 3000.0),
        lambda rows: rows.assign(position=rows.position.clip(upper=1999.0)).drop(columns="speed"),
        lambda rows: rows.assign(position=rows.position.where(rows.index != 300, 0.0)),
    ],
    ids=["an accelerometer", "a brake", "a gauge below 0", "a standstill", "one outlier"],
)
def test_numbers_that_many_rows_have_are_values(
    importing: Import, change: Callable[[pd.DataFrame], pd.DataFrame]
) -> None:
    importing(text(change(ride())))
    assert "no value" not in str(importing.summary["odd"])

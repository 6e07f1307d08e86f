# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A 0 that stands for no value among real pressures and turns is told: taken as measured it looks like a weak brake."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import ride, text

__all__ = ["importing"]


def sensors() -> pd.DataFrame:
    """The ride with a demand, a pipe and an axle."""
    rows = ride(80)
    pressure = rows.brake_pressure
    return rows.assign(
        brake_demand=pressure, brake_pipe=5e5 - pressure / 2.0, wheel_speed_1=(rows.speed / 0.46).round(3)
    )


@pytest.mark.parametrize("every", [2, 7, 40], ids="every {}".format)
@pytest.mark.parametrize("name", ["brake_pressure", "brake_demand", "wheel_speed_1"])
def test_a_zero_for_moments_is_told(importing: Import, name: str, every: int) -> None:
    rows = sensors().drop(columns="brake_pipe")
    gaps = (rows.index % every == 1) & (rows.time > 21.0) & (rows.time < 65.0)
    assert importing(text(rows.assign(**{name: rows[name].mask(gaps, 0.0)}))) == 1
    told = f"{name} is 0 in {gaps.sum()} rows between others of the same value: no value? Leave those cells empty"
    assert importing.summary["odd"] == [told]
    importing.output = importing.output.with_name("cured")
    assert importing(text(rows.assign(**{name: rows[name].mask(gaps)}))) == 0


def test_a_value_in_every_tenth_row_with_zeros_between_is_told(importing: Import) -> None:
    rows = ride()
    importing(text(rows.assign(brake_pressure=rows.brake_pressure.where(rows.index % 10 == 1, 0.0))))
    (odd,) = importing.summary["odd"]
    assert odd.startswith("brake_pressure is 0 in 351 rows between others")


def test_a_pipe_that_is_empty_for_moments_is_told(importing: Import) -> None:
    """It would ask for a full brake of a train that runs."""
    rows = sensors().drop(columns=["brake_pressure", "brake_demand"])
    assert importing(text(rows.assign(brake_pipe=rows.brake_pipe.mask(rows.index % 9 == 4, 0.0)))) == 1
    (odd,) = importing.summary["odd"]
    assert odd.startswith("brake_pipe is at its lowest in ")
    assert odd.endswith("between others of the same value: no value? Leave those cells empty")


@pytest.mark.parametrize("rows_per_s", [1, 2, 10])
def test_slide_protection_that_vents_the_cylinders_is_none(importing: Import, rows_per_s: int) -> None:
    """In a second it does so to 0, holds, and fills them in one and a half."""
    rows = ride()[:: 10 // rows_per_s]
    cycle = np.interp(rows.time % 4.0, [0.0, 0.5, 1.3, 2.0, 3.5], [1.0, 1.0, 0.0, 0.0, 1.0])
    importing(text(rows.assign(brake_pressure=(rows.brake_pressure * cycle).round(-4))))
    assert importing.summary["odd"] == []


def test_a_brake_that_is_released_and_applied_again_is_none(importing: Import) -> None:
    rows = ride()
    importing(text(rows.assign(brake_pressure=rows.brake_pressure.where(rows.time % 8.0 > 3.0, 0.0))))
    assert importing.summary["odd"] == []

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A counter of the distance that wraps goes on where the train does; anything else that falls at once is said."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

__all__ = ["importing"]


@pytest.mark.parametrize("drop", [[], ["speed"]], ids=str)
@pytest.mark.parametrize("falls", [False, True])
@pytest.mark.parametrize(
    ("counter", "said"),
    [
        ((65_536.0, 1.0, 0.0), "65536 m wrapped once"),
        ((65_536.0, 1.0, -32_768.0), "65536 m wrapped once"),
        ((6_553.6, 0.1, 0.0), "6553.6 m wrapped once"),
        ((100_000.0, 1.0, 0.0), "100000 m wrapped once"),
        ((100_000.0, 10.0, 0.0), "100 km wrapped once"),
        ((1_000.0, 0.01, 0.0), "1000 m wrapped 2 times"),
    ],
)
def test_a_counter_that_wraps_goes_on(
    importing: Import,
    capsys: pytest.CaptureFixture[str],
    counter: tuple[float, float, float],
    said: str,
    falls: bool,
    drop: list[str],
) -> None:
    range_m, resolution_m, least_m = counter
    way = ((ride().position * (-1.0 if falls else 1.0)) / resolution_m).round() * resolution_m
    begins = (2_000.0 if falls else -2_000.0) + (0.0 if "once" in said else 500.0) + 1e-9
    counted = (way + begins) % range_m + least_m
    rows = ride().assign(position=(counted / (1e3 if "km" in said else 1.0)).round(3)).drop(columns=drop)
    options = [*(["--position-unit", "km"] if "km" in said else []), *(["--direction", "down"] if falls else [])]
    assert importing(text(rows), *options) == 0, importing.errors
    places = np.array([sample.position_m for sample in importing.positions()])
    assert places - places[0] == pytest.approx(np.abs(way - way[0]).to_numpy(), abs=1e-6)
    assert any(
        f"position: a counter up to {said} as the train ran on" in line for line in read_as(importing, capsys, *options)
    )


@pytest.mark.parametrize(
    "change",
    [
        lambda r: r.assign(position=r.position % 3000.0),
        lambda r: r.assign(position=r.position.where(r.time < 40.0, r.position - 1030.0)),
        lambda r: r.assign(position=r.position.where(r.time < 40.0, (r.position - 2000.0) * 0.5)),
        lambda r: r.assign(position=r.position.where(r.index % 200 != 100, 0.0)),
    ],
    ids=["another range", "a leap that is no range", "another speed", "outliers"],
)
def test_what_is_no_wrap_stays(importing: Import, capsys: pytest.CaptureFixture[str], change: object) -> None:
    assert callable(change)
    rows: pd.DataFrame = change(ride())
    importing(text(rows))
    assert [sample.position_m for sample in importing.positions()] == rows.position.tolist()
    assert "wrapped" not in str(read_as(importing, capsys))

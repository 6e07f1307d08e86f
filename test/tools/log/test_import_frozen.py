# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A sensor that froze is told as one, not as a wrong unit; a train that stands or runs steadily has none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_held import measured
from test_import_log import ride, text

__all__ = ["importing"]


@pytest.mark.parametrize("since", [30, 50, 65])
@pytest.mark.parametrize(
    ("froze", "others"),
    [
        (["position"], ["speed", "brake_pressure"]),
        (["speed"], ["position", "brake_pressure"]),
        (["position", "speed"], ["brake_pressure"]),
        (["position", "speed", "brake_pressure"], []),
        (["position"], ["brake_pressure"]),
        (["speed"], ["brake_pressure"]),
        (["lat", "lon"], []),
        (["lat", "lon"], ["speed", "brake_pressure"]),
    ],
    ids=str,
)
@pytest.mark.parametrize("ends", [80, 75])
def test_what_froze_is_told_with_its_cure(
    importing: Import, froze: list[str], others: list[str], since: int, ends: int
) -> None:
    rows = measured(80)[["time", *froze, *others]]
    rows[froze] = rows[froze].mask((rows.time > since) & (rows.time < ends)).ffill()
    assert importing(text(rows)) == 1
    names = " and ".join(name for name in froze if name != "brake_pressure")
    (odd,) = importing.summary["odd"]
    assert odd.startswith(f"{names}: one value from {since} s to {'the end' if ends == 80 else f'{ends - 0.1} s'}, ")
    assert odd.endswith("while the train runs: a sensor that froze: leave those cells empty, or cut the log there")


STEADY: list[tuple[str, Callable[[pd.DataFrame], pd.DataFrame]]] = [
    ("a stop", lambda r: r.assign(position=r.position.cummax(), speed=r.speed.clip(0.0))),
    ("a stop by tenths of a kilometre", lambda r: r.assign(position=r.position.cummax().round(-2))),
    ("a stop by 5 km/h", lambda r: r.assign(speed=(r.speed * 0.72).clip(0.0).round() / 0.72)),
    ("a run after a halt", lambda r: pd.concat([r.iloc[:1].assign(time=r.time.iloc[0] - 90.0, speed=0.0), r])),
    ("kilometres", lambda r: r.assign(position=(r.position.cummax() / 1e3).round(1))),
]


@pytest.mark.parametrize("drop", [[], ["speed"], ["position"]], ids=str)
@pytest.mark.parametrize("change", [case[1] for case in STEADY], ids=[case[0] for case in STEADY])
def test_what_stands_or_is_coarse_did_not_freeze(
    importing: Import, change: Callable[[pd.DataFrame], pd.DataFrame], drop: list[str]
) -> None:
    rows = ride(82)
    rest = pd.DataFrame({"time": 82.0 + np.arange(300) / 10.0, "speed": 0.0, "brake_pressure": 3e5})
    rows = change(pd.concat([rows, rest.assign(position=rows.position.iloc[-1])])).drop(columns=drop)
    importing(text(rows.assign(time=rows.time - rows.time.min())))
    assert "froze" not in str(importing.summary["odd"])


def test_a_clock_that_stands_still_is_told(importing: Import) -> None:
    rows = measured()
    importing(text(rows.assign(time=rows.time.clip(upper=40.0))))
    assert importing.errors[0].endswith("the clock stands still from there on: cut the log there")

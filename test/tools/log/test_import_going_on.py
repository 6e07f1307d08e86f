# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Clocks and counters of time that begin anew while the train runs on: so do the times."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

from adhesion_node.wire.topics import SPEED

__all__ = ["importing"]

S = 10**9


def test_the_clock_goes_on_after_midnight(importing: Import) -> None:
    assert importing("time,speed\n23:59:59.9,1\n00:00:00.0,1\n00:00:00.1,1\n") == 0
    times = [SPEED.read(message).t_ns for message in importing.messages("speed")]
    assert np.diff(times).tolist() == [S // 10, S // 10]


@pytest.mark.parametrize(
    ("first", "per_s", "period", "options"),
    [
        (86_390, 1, 86_400, []),
        (86_390, 1000, 86_400_000, ["--time-unit", "ms"]),
        (604_790, 1, 604_800, []),
        (60, 1000, 65_536, ["--time-unit", "ms"]),
    ],
)
def test_a_counter_of_time_that_begins_anew_goes_on(
    importing: Import,
    capsys: pytest.CaptureFixture[str],
    first: float,
    per_s: int,
    period: int,
    options: list[str],
) -> None:
    rows = ride().assign(time=lambda ours: ((first + ours.time) * per_s).round(3) % period)
    assert importing(text(rows), *options) == 0, importing.errors
    t_ns = [sample.t_ns for sample in importing.positions()]
    assert t_ns == [round((first + i / 10) * S) for i in range(600)]
    assert any("began anew: it goes on" in line for line in read_as(importing, capsys, *options))


def test_the_hour_of_a_clock_of_minutes_goes_on(importing: Import) -> None:
    moments = pd.Timestamp("2024-11-21 08:59:50") + pd.to_timedelta(ride().time, unit="s")
    assert importing(text(ride().assign(time=moments.dt.strftime("%M:%S.%f")))) == 0, importing.errors
    assert [sample.t_ns for sample in importing.positions()] == [round((3590 + i / 10) * S) for i in range(600)]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Pressures that are told as parts of a full brake's: in per cent, or as a flag."""

from __future__ import annotations

from collections.abc import Callable

import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

from adhesion_node.wire.topics import BRAKE_DEMAND, BRAKE_PRESSURE

__all__ = ["importing"]

FULL_PA = 410e3
"""Of the CRH3."""

BRAKES = ride().brake_pressure > 0.0


@pytest.mark.parametrize(
    ("cells", "unit"),
    [
        (BRAKES * 100, "percent"),
        (BRAKES * 100, "%"),
        (BRAKES * 1, "full"),
        (BRAKES, "full"),
        (BRAKES.map({True: "on", False: "off"}), "full"),
    ],
)
def test_a_share_is_that_of_a_full_brake(
    importing: Import, capsys: pytest.CaptureFixture[str], cells: pd.Series[object], unit: str
) -> None:
    assert importing(text(ride().assign(brake_pressure=cells)), "--pressure-unit", unit) == 0, importing.errors
    pressures = [BRAKE_PRESSURE.read(message).pressure_pa for message in importing.messages("brake_pressure")]
    assert pressures == pytest.approx((BRAKES * FULL_PA).tolist(), abs=1e-3)
    said = read_as(importing, capsys, "--pressure-unit", unit)
    assert "brake_pressure: a full brake is 410000 Pa in the cylinders, --full-pressure" in said


def test_the_header_tells_a_share_beside_a_pressure(importing: Import) -> None:
    rows = ride().assign(**{"brake_demand [%]": 100 * BRAKES}).rename(columns={"brake_pressure": "brake_pressure [Pa]"})
    assert importing(text(rows), "--full-pressure", "380000") == 0, importing.errors
    demands = [BRAKE_DEMAND.read(message).pressure_pa for message in importing.messages("brake_demand")]
    assert max(demands) == pytest.approx(380e3)
    assert BRAKE_PRESSURE.read(importing.messages("brake_pressure")[-1]).pressure_pa == pytest.approx(3e5)


Change = Callable[[pd.DataFrame], pd.DataFrame]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda rows: rows.assign(brake_pressure=BRAKES), "true and false, of a full brake, with --pressure-unit full"),
        (
            lambda rows: rows.drop(columns="brake_pressure").assign(**{"brake_pipe [%]": 100 * BRAKES}),
            "brake_pipe is said to be in percent",
        ),
    ],
)
def test_what_is_no_share_or_not_said_to_be_one_is_told(importing: Import, change: Change, told: str) -> None:
    assert importing(text(change(ride()))) == 2
    assert told in importing.errors[0]

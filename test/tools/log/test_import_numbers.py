# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Numbers as people write them: separators of thousands, decimal signs, and what stands for no value."""

from __future__ import annotations

import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

from adhesion_node.wire.topics import BRAKE_PRESSURE, SPEED

__all__ = ["importing"]


def in_groups(rows: pd.DataFrame, separator: str, decimal: str) -> pd.DataFrame:
    """Numbers with separators of thousands; whole ones have no decimals. Times pass 1000 s in their midst."""
    signs = str.maketrans(",.", separator + decimal)
    written = {name: rows[name].map("{:,.2f}".format) for name in ("position", "speed")}
    times = (rows.time + 970.0).map("{:,.1f}".format)
    written |= {"brake_pressure": rows.brake_pressure.map("{:,.0f}".format), "time": times}
    return rows.assign(**{name: cells.str.translate(signs) for name, cells in written.items()})


@pytest.mark.parametrize(("delimiter", "separator", "decimal"), [(";", ".", ","), (",", ",", ".")])
def test_thousands_are_read_where_the_decimal_sign_is_sure_and_that_is_said(
    importing: Import, capsys: pytest.CaptureFixture[str], delimiter: str, separator: str, decimal: str
) -> None:
    rows = ride()
    assert importing(text(in_groups(rows, separator, decimal), delimiter)) == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == rows.position.round(2).tolist()
    pressures = [BRAKE_PRESSURE.read(message).pressure_pa for message in importing.messages("brake_pressure")]
    assert pressures == pytest.approx(rows.brake_pressure.tolist())
    assert f"brake_pressure: '300{separator}000' is read as 300000" in read_as(importing, capsys)


@pytest.mark.parametrize("separator", ["'", " ", "\u2019", "\u00a0", "\u2009", "\u202f"])
@pytest.mark.parametrize("decimal", [".", ","])
def test_thousands_apart_by_no_decimal_sign_are_read(importing: Import, separator: str, decimal: str) -> None:
    """As Switzerland and France write them."""
    rows = ride()
    assert importing(text(in_groups(rows, separator, decimal), ";")) == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == rows.position.round(2).tolist()
    pressures = [BRAKE_PRESSURE.read(message).pressure_pa for message in importing.messages("brake_pressure")]
    assert pressures == pytest.approx(rows.brake_pressure.tolist())


def test_a_minus_as_it_is_printed_is_one(importing: Import) -> None:
    assert importing("time,speed\n1,\u22120.5\n2,-0.5\n") == 0, importing.errors
    assert [SPEED.read(message).speed_mps for message in importing.messages("speed")] == [-0.5, -0.5]


def test_thousands_are_named_where_the_decimal_sign_is_not_sure(importing: Import) -> None:
    """Whole numbers first, then what may be either."""
    log = "time;speed;brake_pressure\n" + "".join(f"{i};20;0\n" for i in range(300)) + "300;20;20,000\n"
    assert importing(log) == 1
    assert importing.errors[0].endswith(
        "is it in groups of thousands? Export it without them; or is the --decimal another?"
    )


@pytest.mark.parametrize(
    ("cells", "speed"), [(("1,250", "0,5"), 1.25), (("1.250", "0.5"), 1.25), (("1,250", "2,500"), 1.25)]
)
def test_three_decimals_are_no_thousands(importing: Import, cells: tuple[str, str], speed: float) -> None:
    assert importing(f"time;speed\n1;{cells[0]}\n2;{cells[1]}\n") == 0
    assert SPEED.read(importing.messages("speed")[0]).speed_mps == speed

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Lines that are no rows: units, comments and types below the header, and the header in the midst again."""

from __future__ import annotations

import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

from adhesion_node.wire.topics import SPEED

__all__ = ["importing"]


def test_the_same_header_once_more_is_left_out_and_said(importing: Import) -> None:
    header, *rows = text(ride()).splitlines(keepends=True)
    assert importing("".join([header, *rows[:100], header, *rows[100:]])) == 1
    told = "import_csv: FILE:102: row = 'time,position,speed,brake_pressure': the header once more: it is left out"
    assert importing.errors == [told]
    assert importing.summary["refused"] == {"header": 1}
    assert importing.summary["written"] == len(rows)


@pytest.mark.parametrize(
    "other",
    [
        ride()[["time", "speed", "position", "brake_pressure"]],
        ride().assign(speed_std=0.1),
        ride().drop(columns="speed"),
        ride().assign(speed=3.6 * ride().speed).rename(columns={"speed": "speed [km/h]"}),
    ],
    ids=["another order", "a further column", "a column less", "another unit"],
)
def test_another_header_is_refused(importing: Import, other: pd.DataFrame) -> None:
    log = text(ride()[:300]) + text(other[300:])
    assert importing(log) == 2
    (said,) = importing.errors
    assert said.startswith(f"import_csv: FILE:302: another header, {list(other)} after {list(ride())}: cut the log")


def test_columns_without_a_name_may_be_several(importing: Import) -> None:
    """Beside a place letters of a latitude are looked for; of two such columns nobody knew which was meant."""
    rows = ride()[["time", "speed", "brake_pressure", "position"]]
    assert importing(text(rows).replace("\n", ",,\n")) == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == rows["position"].tolist()


@pytest.mark.parametrize("mark", ["#N/A", "--", "---", "<null>", "\\N", "n.a.", "(null)"])
def test_what_is_written_for_no_value_is_an_empty_cell(importing: Import, mark: str) -> None:
    rows = ride().astype(str)
    assert importing(text(rows.assign(speed=rows.speed.mask(rows.index % 7 == 3, mark)))) == 0, importing.errors
    assert importing.summary["empty"] == {"speed": 86}


def test_a_name_with_a_line_break_is_told_with_its_line(importing: Import) -> None:
    rows = ride().rename(columns={"position": "position\n[m]"})
    assert importing(text(rows, head="Recorder X\n")) == 2
    (said,) = importing.errors
    assert said.startswith("import_csv: FILE:2: quotes are not closed in this line: close them, or take the line break")


@pytest.mark.parametrize(
    ("below", "left_out"),
    [
        (["s,m,km/h,bar", "GPS clock,odometer,radar,BC 1"], "lines 2 to 3 left out, units in line 2"),
        (["double,double,double,double", "[s],[m],[km/h],[bar]"], "lines 2 to 3 left out, units in line 3"),
        (["", "s,m,km/h,bar"], "lines 2 to 3 left out, units in line 3"),
        (["GPS clock,,,BC 1", "double,,,", "s,m,km/h,bar"], "lines 2 to 4 left out, units in line 4"),
    ],
)
def test_units_are_found_beside_comments_and_types(
    importing: Import, capsys: pytest.CaptureFixture[str], below: list[str], left_out: str
) -> None:
    rows = ride().assign(
        speed=lambda ours: ours["speed"] * 3.6, brake_pressure=lambda ours: ours["brake_pressure"] / 1e5
    )
    header, *written = text(rows).splitlines()
    assert importing("\n".join([header, *below, *written])) == 0, importing.errors
    assert SPEED.read(importing.messages("speed")[0]).speed_mps == pytest.approx(50.0)
    assert any(left_out in line for line in read_as(importing, capsys))


def test_a_header_and_lines_behind_the_mark_of_a_comment(importing: Import) -> None:
    """As numpy.savetxt writes a header; what else is a comment is none of the rows."""
    header, *rows = text(ride()).splitlines()
    lines = ["# recorder X", f"# {header}", *rows[:300], "# door, opened", *rows[300:], "# end"]
    assert importing("\n".join(lines)) == 0, importing.errors
    assert importing.summary["rows"] == 600


def test_rows_that_are_numbered_with_a_mark_are_none(importing: Import) -> None:
    header, *rows = text(ride()).splitlines()
    assert importing("\n".join([f"#,{header}", *(f"#{i},{row}" for i, row in enumerate(rows))])) == 0, importing.errors
    assert importing.summary["written"] == 600


def test_numbers_alone_are_no_header(importing: Import) -> None:
    assert importing("0.0e+00,1.0e+03\n1.0E-01,1.1e+03\n") == 2
    assert "has no header line" in importing.errors[0]

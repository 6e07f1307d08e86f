# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a log is as a file: packed text is read, what is no text is told as what it is."""

from __future__ import annotations

import bz2
import gzip
import lzma
from collections.abc import Callable
from io import BytesIO

import numpy as np
import pytest
from test_import_csv import Import, importing
from test_import_log import ride, text

__all__ = ["importing"]


@pytest.mark.parametrize(
    ("begins", "what"),
    [
        (b"PK\x03\x04\x14", "is a zip file or a workbook, no text: unpack it, or save it as CSV"),
        (b"\xd0\xcf\x11\xe0", "is a workbook, no text: unpack it, or save it as CSV"),
        (b"\x28\xb5\x2f\xfd\x24\0", "is packed: unpack it, or pack it by gzip"),
        (b"\x89MCAP0\r\n\0", "is a recording, no log: replay --offline reads it"),
        (b"MDF     4.10\0\0\0", "is no text: save it as CSV or as Parquet, or name its --encoding"),
        (b"TDSm\x0e\0\0\0", "is no text: save it as CSV or as Parquet, or name its --encoding"),
        (np.arange(99).astype("<i4").tobytes(), "is no text: save it as CSV or as Parquet, or name its --encoding"),
        (b"\0" * 99, "is no text: save it as CSV or as Parquet, or name its --encoding"),
    ],
)
def test_what_is_no_text_is_told(importing: Import, begins: bytes, what: str) -> None:
    assert importing(begins + text(ride()).encode()) == 2
    assert importing.errors == [f"import_csv: FILE: {what}"]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize(
    ("written", "what"),
    [
        ('[{"time": 1.0, "position": 2.0}]', "is JSON"),
        ('{\n  "rows": [{"time": 1.0}]\n}', "is JSON"),
        ('{"time": 1.0}\n{"time": 2.0}\n', "is JSON"),
        ('\n<?xml version="1.0"?>\n<gpx><trkpt lat="50.0" lon="8.0"/></gpx>', "is XML, as GPX and KML are"),
        ('<kml><when>2024-01-01</when>, "8.0, 50.0"</kml>', "is XML, as GPX and KML are"),
        ("$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\n" * 9, "is NMEA 0183"),
    ],
)
def test_what_is_no_table_is_told(importing: Import, written: str, what: str, encoding: str) -> None:
    """It was said to have no header line, or no column time."""
    assert importing(written.encode(encoding)) == 2
    assert importing.errors[0].startswith(f"import_csv: FILE: {what}")
    assert ", no table: save it as CSV, a header and one row per time" in importing.errors[0]


@pytest.mark.parametrize("above", ['{"unit": 7}\n', "<?recorder 7?>\n"])
def test_a_table_may_have_another_text_above(importing: Import, above: str) -> None:
    assert importing(above + text(ride())) == 0, importing.errors


@pytest.mark.parametrize("pack", [gzip.compress, bz2.compress, lzma.compress])
def test_what_is_packed_is_read(importing: Import, pack: Callable[[bytes], bytes]) -> None:
    rows = ride()
    assert importing(pack(text(rows).encode("utf-16"))) == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == rows["position"].tolist()
    packed = pack(text(rows).encode())
    importing.output = importing.output.with_name("cut")
    for broken in (packed[: len(packed) // 2], packed[:6] + b"no packer wrote this"):
        assert importing(broken) == 2
        assert importing.errors[0].startswith("import_csv: FILE: is packed, and cannot be unpacked")


def test_parquet_of_any_name_is_read(importing: Import) -> None:
    pytest.importorskip("pyarrow")
    packed = BytesIO()
    ride().to_parquet(packed)
    assert importing(packed.getvalue()) == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == ride()["position"].tolist()

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
        (b"\x89MCAP0\r\n\0", "is a recording, no log: replay --offline reads it"),
        (b"MDF     4.10\0\0\0", "is no text: save it as CSV or as Parquet"),
        (b"TDSm\x0e\0\0\0", "is no text: save it as CSV or as Parquet"),
        (np.arange(99).astype("<i4").tobytes(), "is no text: save it as CSV or as Parquet"),
        (b"\0" * 99, "is no text: save it as CSV or as Parquet"),
    ],
)
def test_what_is_no_text_is_told(importing: Import, begins: bytes, what: str) -> None:
    assert importing(begins + text(ride()).encode()) == 2
    assert importing.errors == [f"import_csv: FILE: {what}"]


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

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Rows of numbers, filled into the forms of doc/evidence_tables.json."""

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from interface_tables import table

Row = Mapping[str, Any]

COLUMNS: dict[str, Sequence[tuple[str, str]]] = json.loads(
    Path(__file__).with_name("evidence_tables.json").read_text("utf-8")
)
"""Heads of the tables, and the forms into which the numbers of a row are filled."""


def cell(form: str, row: Row) -> str:
    """Fill in a form; a dash where a number is missing: None takes no format."""
    try:
        return re.sub(r"(?<=\d)%", " %", form.format_map(row))
    except TypeError:
        return "–"


def listed(columns: Sequence[tuple[str, str]], rows: Iterable[Row], fill: Callable[[str, Row], str] = cell) -> str:
    """Return a table of a line per row."""
    return table([head for head, _ in columns], ([fill(form, row) for _, form in columns] for row in rows))

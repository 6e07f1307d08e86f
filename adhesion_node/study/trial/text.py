# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tables for people."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple


class Column(NamedTuple):
    """A column: its head, its width, the format of its values and where they come from in a row."""

    head: str
    width: int
    form: str
    value: str | Callable[[Mapping[str, Any]], Any]

    def cell(self, row: Mapping[str, Any]) -> str:
        """A row's value; "-" where it has none."""
        value = row.get(self.value) if isinstance(self.value, str) else self.value(row)
        return f"{'-' if value is None else format(value, self.form):>{self.width}}"


def lines(columns: Iterable[Column], rows: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """Head and rows.

    >>> list(lines([Column("run", 4, "", "run"), Column("mu", 6, ".3f", "mu")], [{"run": 1, "mu": 0.07}]))
    [' run     mu', '   1  0.070']
    """
    columns = tuple(columns)
    yield " ".join(f"{column.head:>{column.width}}" for column in columns)
    for row in rows:
        yield " ".join(column.cell(row) for column in columns)

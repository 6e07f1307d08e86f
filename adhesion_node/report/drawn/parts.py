# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Parts that the pages of reports share: tables, values, versions."""

import math
import platform
from collections.abc import Iterable, Sequence
from html import escape
from importlib.metadata import PackageNotFoundError, version


def value_or(value: float | None, form: str, absent: str = "–") -> str:
    """A value in its form; `absent` for None and what is not a number."""
    return absent if value is None or math.isnan(value) else form.format(value)


def versions() -> str:
    """The versions that made the page."""
    names = ("adhesion_node", "numpy", "scipy")
    listed = [f"{name} {_version(name)}" for name in names] + [f"Python {platform.python_version()}"]
    return f"<h2>Versions</h2><p>{escape(', '.join(listed))}</p>"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:  # run from the source tree
        return "not installed"


def table_html(header: Sequence[str], body: Iterable[Sequence[str]], kind: str = "") -> str:
    """A table of cells that are HTML already."""
    of_kind = f' class="{kind}"' if kind else ""
    head = "".join(f"<th{of_kind}>{cell}</th>" for cell in header)
    lines = "".join("<tr>" + "".join(f"<td{of_kind}>{cell}</td>" for cell in row) + "</tr>" for row in body)
    return f'<div class="scroll" tabindex="0"><table><thead><tr>{head}</tr></thead><tbody>{lines}</tbody></table></div>'

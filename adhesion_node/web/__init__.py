# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Self-contained HTML pages: style, scripts and data stand in the page, nothing is fetched from elsewhere."""

import json
from importlib.resources import files
from string import Template
from typing import Any

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""What a page may do: nothing but what stands in it."""

_CHARTS = ("language.js", "uplot.js", "chart.js")
STYLES = {
    "report": ("uplot.css", "style.css"),
    "fleet": ("uplot.css", "style.css", "fleet.css"),
    "live": ("uplot.css", "style.css", "live.css"),
}
SCRIPTS = {
    "report": (*_CHARTS, "creep.js", "report.js"),
    "fleet": (*_CHARTS, "fleet.js"),
    "live": (*_CHARTS, "dial.js", "creep.js", "live.js"),
}
"""What stands in each page, in this order."""


def page(name: str, **parts: str) -> str:
    """Return the page `name`.html with its styles and scripts inlined.

    `parts` fill its $placeholders and must be HTML already, or JSON by `as_json` inside a script element.
    """
    style, script = ("\n".join(map(_read, kind[name])) for kind in (STYLES, SCRIPTS))
    return Template(_read(f"{name}.html")).substitute(style=style, script=script, policy=POLICY, **parts)


def as_json(data: Any) -> str:
    r"""Return compact JSON that may stand inside a script element. Raises ValueError for a number that is not finite.

    >>> as_json({"name": "</script>"})
    '{"name":"\\u003c/script>"}'
    """
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _read(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")

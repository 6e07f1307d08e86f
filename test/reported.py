# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The page and the JSON of a report, as tests look at them."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from adhesion_node.report.__main__ import main


class Parser(HTMLParser):
    """Collects texts, the embedded data, and every attribute that could fetch something."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.fetched: list[str] = []
        self._inside = ""
        self.data: dict[str, Any] = {}
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._inside = tag if tag in ("script", "style") else self._inside
        if tag == "script" and ("id", "data") in attrs:
            self._inside = "data"
        asked = [name for name, value in attrs if not str(value).startswith("data:")]
        self.fetched += [f"{tag} {name}" for name in asked if name in ("src", "href", "srcset", "action")]
        self.fetched += [tag] if tag in ("iframe", "object", "base") else []

    def handle_endtag(self, tag: str) -> None:
        self._inside = "" if tag in ("script", "style") else self._inside

    def handle_data(self, data: str) -> None:
        if self._inside == "data":
            self.data = json.loads(data)
        elif not self._inside and data.strip():
            self.texts.append(data.strip())


def make(tmp_path: Path, *arguments: str) -> tuple[dict[str, Any], Parser]:
    """Run the command; return its JSON and the page."""
    result = tmp_path / "result.json"
    assert main([*arguments, "--output", str(tmp_path / "report"), "--json", str(result)]) == 0
    return json.loads(result.read_text()), Parser((tmp_path / "report" / "report.html").read_text(encoding="utf-8"))


def lines(run: dict[str, Any], title: str) -> dict[str, dict[str, Any]]:
    """Return the lines of the chart whose title begins so, by their labels."""
    (chart,) = (chart for chart in run["charts"] if chart["title"].startswith(title))
    return {line["label"]: line for line in chart["lines"]}

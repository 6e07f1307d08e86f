# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What viewers are sent: all of the parts at first, then what has changed, made once for all viewers."""

from collections.abc import Callable, Mapping
from typing import Any

from ..web import as_json
from .view import Rows

Parts = Callable[[], dict[str, Any]]

SLOW = ("curves", "ahead", "inputs")
"""Parts that are long: they are sent at most every `SLOW_S`."""

SLOW_S = 1.0


class Feed:
    """Compares the parts with those sent last. Mutable."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._sent: dict[str, Any] = {}
        self._slow_s = -SLOW_S

    def whole(self) -> str:
        """All that has been sent so far: what comes next fits behind it."""
        if not self._sent:
            self._sent = self._parts()
        return as_json({"now": self._sent["now"], "all": {name: _plain(part) for name, part in self._sent.items()}})

    def news(self) -> str:
        """What has changed since: parts anew, single entries of parts, rows behind histories."""
        parts, sent = self._parts(), self._sent
        if parts["now"] - self._slow_s < SLOW_S and parts["run"] == sent.get("run"):
            parts |= {name: sent[name] for name in SLOW if name in sent}
        else:
            self._slow_s = parts["now"]
        anew: dict[str, Any] = {}
        entries: dict[str, Any] = {}
        rows: dict[str, Any] = {}
        for name, part in parts.items():
            before = sent.get(name)
            if name == "now" or part == before:
                continue
            if isinstance(part, Rows) and isinstance(before, Rows) and parts["run"] == sent["run"]:
                rows[name] = part.rows[max(before.gone + len(before.rows) - part.gone, 0) :]
            elif isinstance(part, Mapping) and isinstance(before, Mapping) and part.keys() >= before.keys():
                entries[name] = {key: value for key, value in part.items() if key not in before or before[key] != value}
            else:
                anew[name] = _plain(part)
        self._sent = parts
        told = {"set": anew, "change": entries, "add": rows}
        return as_json({"now": parts["now"], **{kind: news for kind, news in told.items() if news}})


def _plain(part: Any) -> Any:
    return part.rows if isinstance(part, Rows) else part

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Layouts of Foxglove and PlotJuggler for our topics, of any namespace."""

import re
from importlib.resources import files

from ..wire.topics import TOPICS

NAMES = ("foxglove.json", "plotjuggler.xml")

HARDWARE, ENTRIES = "train", ("atp_monitor/supervision", "estimator/adhesion")
"""In /diagnostics, without a namespace: the train, and the entries that the layouts show."""

_OURS = "|".join(sorted((re.escape(topic.name) for topic in TOPICS if not topic.name.startswith("/")), reverse=True))
_TOPIC = re.compile(rf'(?<=")/({_OURS})(?=["./\[])')

_SPACE = re.compile(r"[a-z_]\w*(/[a-z_]\w*)*", re.ASCII | re.IGNORECASE)


def layout(name: str, namespace: str = "") -> str:
    """Return one of `NAMES` for the nodes of a namespace. Raises ValueError for what can be none.

    >>> '"/line/train1/adhesion/mu.data"' in layout("foxglove.json", "/line/train1")
    True
    """
    text, inner = files(__package__).joinpath(name).read_text(encoding="utf-8"), namespace.strip("/")
    if not inner:
        return text
    if not _SPACE.fullmatch(inner):
        raise ValueError(f"namespace = {namespace!r}: give names of letters, digits and _, as /train1 or /line/train1")
    text = _TOPIC.sub(rf"/{inner}/\1", text)
    text = text.replace(f"/{HARDWARE}/{ENTRIES[0]}/", f"/{inner}/{inner}/{ENTRIES[0]}/")
    for entry in ENTRIES:
        text = text.replace(f'"{entry}', f'"{inner}/{entry}')
    return text.replace(f'"selectedHardwareId": "{HARDWARE}"', f'"selectedHardwareId": "{inner}"')

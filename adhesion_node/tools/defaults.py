# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Writes nodes/defaults.yaml, the parameters of all nodes with their defaults, out of their declarations.

python -m adhesion_node.tools.defaults
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from sim_node import settings as simulated

from ..core.setting import Setting, Value, by_group
from ..wire.settings.nodes import OF_NODES

FILE = Path(__file__).resolve().parent.parent / "nodes" / "defaults.yaml"

HEAD = """\
# The parameters of all nodes with their defaults, in any namespace, for `--ros-args --params-file`. What each one
# means, its unit and its range: `ros2 param describe`, `--help` of the node, or doc/parameters.md. Change a copy, keep
# the lines that you change, and give it before any `-p`: ROS ranks by the first mention of a name, `-p` is `/**`.
# Written by `python -m adhesion_node.tools.defaults` out of the declarations.
"""


def all_settings() -> Mapping[str, Sequence[Setting]]:
    """Return the settings of every node and simulator by the node's name."""
    return {**OF_NODES, **simulated.OF_NODES}


def text() -> str:
    """Return what the file should hold."""
    sections = (
        "\n".join((f"\n/**/{node}:", "  ros__parameters:", *_lines(of_node)))
        for node, of_node in all_settings().items()
    )
    return HEAD + "\n".join(sections) + "\n"


def _lines(of_node: Sequence[Setting]) -> Iterator[str]:
    for group, members in by_group(of_node).items():
        parent = members[0].name.rpartition(".")[0]
        if parent:
            yield f"    {parent}:"
        elif group:
            yield f"    # {group}"
        for one in members:
            unit = f"  # {one.unit}" if one.unit else ""
            yield f"    {'  ' if parent else ''}{one.name.rpartition('.')[2]}: {_spelled(one.default)}{unit}"


def _spelled(value: Value) -> str:
    """Spell a value so that YAML 1.1 reads its type.

    >>> [_spelled(value) for value in (True, 1, 1e-6, 0.5, "snow")]
    ['true', '1', '1.0e-06', '0.5', '"snow"']
    """
    return re.sub(r"^(-?\d+)e", r"\1.0e", json.dumps(value))


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")

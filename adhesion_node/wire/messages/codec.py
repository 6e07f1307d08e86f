# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a codec is.

A message is read from any object with its fields: rclpy's, what rosbags reads from a file, a plain one. It is made by
a `New`: of rclpy's classes (nodes/ros/types.py), of those of rosbags (bag/types.py), or as a `plain` object.
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, NamedTuple, Protocol

from ..line import Line

Fields = dict[str, Any]
"""The fields of a message by name."""


class New(Protocol):
    """Makes a message or a part of one of a type in ROS spelling.

    Every field of the type is given: numbers in a row as a tuple or an array, a byte as `bytes`.
    """

    def __call__(self, type_name: str, /, **fields: Any) -> Any: ...


class Codec(NamedTuple):
    """How the messages of a topic are read, whatever their frame (raises Rejected), and how their fields are written.

    A writer takes a `New` and what it says; it returns None where there is nothing to publish.
    """

    read: Callable[[Any, Line], Any]
    write: Callable[..., Fields | None]
    together: Callable[[Any, Line], Any] | None = None
    """Reads one message that stands for many, its numbers being arrays: NaN for those that `read` refuses."""


def plain(type_name: str, /, **fields: Any) -> SimpleNamespace:
    """Make a plain object with the fields of a message: no ROS, no bag."""
    del type_name
    return SimpleNamespace(**fields)

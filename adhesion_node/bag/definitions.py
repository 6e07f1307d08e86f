# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Definitions of message types, as bags hold them, against ours: by another one bytes are misread without a fault."""

import re
from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import TypesysError, get_types_from_idl, get_types_from_msg

from .types import Definition, typestore

_UNREADABLE = (TypesysError, ValueError, TypeError, AttributeError, ArithmeticError, LookupError, AssertionError)
"""What the parsers raise on a text that is no definition, beside what they take too much of."""

_NO_IDL = re.compile("^(=+|IDL: .*|#include .*)$", re.MULTILINE)
"""What rosbag2 writes between the types of a definition in IDL, and what the parser does not take."""

_SAME = {"byte": "uint8", "char": "uint8"}
"""Names of what are the same bytes: .msg and .idl call them otherwise."""

_FILLER = "structure_needs_at_least_one_member"
"""What ROS 2 makes the field of a message without any."""


@lru_cache  # many topics are of one type, in every file of a recording
def difference(type_name: str, recorded: Definition) -> str | None:
    """Say what is otherwise in a recorded definition of a type of ROS 2 Jazzy: the fields, their types or their order.

    None where nothing is, or where it is not known: the type is one of others, or its definition is not readable.
    Constants, comments, defaults and bounds count for nothing, they move no byte.
    """
    try:
        is_known = type_name in typestore().fielddefs and recorded.text.strip()
        return _difference(type_name, _parsed(type_name, recorded)) if is_known else None
    except (*_UNREADABLE, MemoryError, RecursionError):
        return None


def _parsed(type_name: str, recorded: Definition) -> Any:
    """Return the fields by type; of what is neither .msg nor .idl none."""
    if recorded.encoding == "ros2msg":
        return get_types_from_msg(recorded.text, type_name)
    return get_types_from_idl(_NO_IDL.sub("", recorded.text)) if recorded.encoding == "ros2idl" else {}


def _difference(type_name: str, recorded: Any) -> str | None:
    """Say it of a type or of the first one that it is made of; what is named only is not known."""
    if type_name not in recorded:
        return None
    theirs, ours = (
        [f"{_type(*type_)} {name}" for name, type_ in of[type_name][1] if name != _FILLER]
        for of in (recorded, typestore().fielddefs)
    )
    if theirs != ours:
        fields = f"its fields are {', '.join(theirs)}, ours {', '.join(ours)}"
        return f"recorded with another definition of {type_name} ({fields})"
    parts = (re.split(r"[\[ ]", field)[0] for field in ours)
    return next(filter(None, (_difference(part, recorded) for part in parts)), None)


def _type(node: Nodetype, what: Any) -> str:
    """Write the type of a field."""
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        element, length = what
        return f"{_type(*element)}[{length if node is Nodetype.ARRAY else ''}]"
    name: str = what if node is Nodetype.NAME else what[0]
    return _SAME.get(name, name)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Message classes, CDR and message definitions of ROS 2 Jazzy, without an installed ROS."""

import struct
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_typestore
from rosbags.typesys.store import Typestore

from ..wire.topic import Topic

_UNDECODABLE = (SerdeError, struct.error, ValueError, IndexError, KeyError, OverflowError, MemoryError)
"""What the decoders raise on bytes that are not what they seem."""


class UnknownTypeError(ValueError):
    """A message type that is not part of ROS 2 Jazzy."""


class Definition(NamedTuple):
    """A message definition as a bag holds it: the text and its encoding ("ros2msg" or "ros2idl")."""

    encoding: str
    text: str


@cache
def typestore() -> Typestore:
    """Return the types of ROS 2 Jazzy; `typestore().types["std_msgs/msg/Float64"]` is a message class."""
    return get_typestore(Stores.ROS2_JAZZY)


def new(type_name: str, /, **fields: Any) -> Any:
    """Make a message, or a part of one, for the codecs of `wire`: a tuple becomes an array, a byte its number."""
    return typestore().types[type_name](**{name: _stored(value) for name, value in fields.items()})


def _stored(value: Any) -> Any:
    if isinstance(value, tuple):
        return np.array(value, dtype=np.float64)
    return value[0] if isinstance(value, bytes) else value


def serialize(message: object, type_name: str) -> bytes:
    """Return `message` as little-endian CDR: equal messages give equal bytes, padding included."""
    _require(type_name)
    return bytes(typestore().serialize_cdr(message, type_name, little_endian=True))


def encode(topic: Topic, *values: Any) -> bytes:
    """Return as CDR the message that the topic's codec writes of `values`."""
    return serialize(topic.build(new, *values), topic.type)


def deserialize(cdr: bytes, type_name: str) -> Any:
    """Return the message that `cdr` holds; bytes behind it, which writers leave there, mean nothing.

    Raises UnknownTypeError when the type is unknown, and ValueError when the bytes do not fit it.
    """
    decoders, message_class = _decoders(type_name)
    try:
        message, _ = decoders[bytes(cdr[:2])](memoryview(cdr)[4:], 0, message_class, typestore())
    except _UNDECODABLE as error:
        why = "no CDR" if isinstance(error, KeyError) else error
        raise ValueError(
            f"message of {len(cdr)} bytes: it does not decode as {type_name} ({why}); was another type recorded?"
        ) from error
    return message


@cache
def _decoders(type_name: str) -> tuple[dict[bytes, Callable[..., tuple[Any, int]]], Any]:
    """How the bytes of a type are read, by how they are ordered, and its class; raises UnknownTypeError."""
    _require(type_name)
    known = typestore().get_msgdef(type_name)
    return {b"\0\0": known.deserialize_cdr_be, b"\0\1": known.deserialize_cdr_le}, known.cls


def definition(type_name: str) -> Definition:
    """Return the definition of a type with all that it is made of. Raises ValueError when the type is unknown."""
    _require(type_name)
    return Definition("ros2msg", typestore().generate_msgdef(type_name, ros_version=2)[0])


def type_hash(type_name: str) -> str:
    """Return the RIHS01 hash of a type, or "" for a type that is not part of ROS 2 Jazzy."""
    try:
        return typestore().hash_rihs01(type_name)
    except (KeyError, TypesysError):
        return ""


def same_name(one: str, other: str) -> bool:
    """Tell whether two topic names are the same, with or without the leading slash.

    >>> same_name("/position", "position"), same_name("/train1/position", "position")
    (True, False)
    """
    return one.lstrip("/") == other.lstrip("/")


def _require(type_name: str) -> None:
    if type_name not in typestore().fielddefs:
        raise UnknownTypeError(
            f"message type = {type_name!r}: only the standard messages of ROS 2 Jazzy can be decoded"
        )

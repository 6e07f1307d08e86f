# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Messages of every type with known contents, and recordings of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import cdrs
import numpy as np
from mcap.writer import Writer
from rosbags.interfaces import QosDurability

from adhesion_node.bag import BagWriter, Record
from adhesion_node.bag.qos import RELIABLE
from adhesion_node.bag.types import definition
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION

S = 10**9

LATCHED = RELIABLE._replace(depth=1, durability=QosDurability.TRANSIENT_LOCAL)
"""Who subscribes late gets the last message."""


def ros_class(type_name: str) -> type[Any]:
    package, *_, name = type_name.split("/")
    found: type[Any] = getattr(import_module(f"{package}.msg"), name)
    return found


def filled(type_name: str, numbers: Iterator[int]) -> Any:
    """Return an rclpy message with another value in every field, sequences of two."""
    message = ros_class(type_name)()
    for field, kind in message.get_fields_and_field_types().items():
        element = kind.removeprefix("sequence<").removesuffix(">").split("[")[0].split(",")[0]
        count = int(kind.split("[")[1][:-1]) if "[" in kind else 2
        values = [_value(element, numbers) for _ in range(count)]
        setattr(message, field, values if "[" in kind or kind.startswith("sequence") else values[0])
    return message


def _value(element: str, numbers: Iterator[int]) -> Any:
    number = next(numbers)
    if "/" in element:
        return filled(element, numbers)
    if element == "string":
        return f"text {number}"
    if element == "boolean":
        return True
    if element == "octet":
        return bytes([number % 100])
    return number + 0.5 if element in ("double", "float") else number % 100


def plain(value: Any) -> Any:
    """Return a message of any of the libraries as nested dicts and lists."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value)]  # among them the message's constants, OK = 0
        return {name: plain(getattr(value, name)) for name in names if name.islower() and name != "__msgtype__"}
    if hasattr(value, "__slots__") and not isinstance(value, (np.ndarray, np.generic, bytes)):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, bytes):
        return value[0]
    if isinstance(value, (list, tuple, np.ndarray)) or hasattr(value, "tolist"):
        listed = value.tolist() if hasattr(value, "tolist") else value
        return [plain(item) for item in listed] if isinstance(listed, (list, tuple)) else listed
    return value


def write_steps(path: Path, steps: int, first: int = 0) -> list[Record]:
    """Write positions and pressures at 10 Hz and return what was written."""
    records = []
    for step in range(first, first + steps):
        t_ns = step * S // 10
        records.append(Record("/brake_pressure", BRAKE_PRESSURE.type, cdrs.brake_pressure(t_ns, 101325.0), t_ns))
        records.append(Record("/position", POSITION.type, cdrs.position(t_ns, step / 3, 0.25), t_ns))
    with BagWriter(path) as writer:
        for record in records:
            writer.write(*record)
    return records


class Beside(NamedTuple):
    """A topic as another program writes it: the name of its type, how that is defined, and its messages."""

    topic: str
    encoding: str
    type: str = ""
    defined: tuple[str, bytes] | None = None
    messages: tuple[bytes, ...] = ()


TEXT, NUMBER = "std_msgs/msg/String", "std_msgs/msg/Float64"

JSON = Beside("/log", "json", "Log", ("jsonschema", b"{}"), (b"{}", b"[]"))
PROTOBUF = Beside("/log", "protobuf", "foxglove.Log", ("protobuf", bytes(range(128, 256))), (b"a", b"b"))
UNDEFINED = Beside("/log", "", messages=(b"a", b"b"))


def cdr_beside(topic: str, type_name: str, *messages: bytes) -> Beside:
    return Beside(topic, "cdr", type_name, ("ros2msg", definition(type_name).text.encode()), messages)


def write_beside(file: Path, *others: Beside, steps: int = 3) -> Path:
    """Write an MCAP file of other topics and, in the same chunk, of what `write_steps` writes."""
    ours: dict[str, list[bytes]] = {}
    for step in range(steps):
        ours.setdefault("/brake_pressure", []).append(cdrs.brake_pressure(step * S // 10, 101325.0))
        ours.setdefault("/position", []).append(cdrs.position(step * S // 10, step / 3, 0.25))
    types = {"/brake_pressure": BRAKE_PRESSURE.type, "/position": POSITION.type}
    with file.open("wb") as stream:
        writer: Any = Writer(stream)
        writer.start(profile="ros2")
        for one in (*others, *(cdr_beside(name, types[name], *messages) for name, messages in ours.items())):
            schema = writer.register_schema(one.type, *one.defined) if one.defined else 0
            channel = writer.register_channel(one.topic, one.encoding, schema)
            for step, data in enumerate(one.messages):
                writer.add_message(channel, log_time=step * S // 10, data=data, publish_time=0)
        writer.finish()
    return file

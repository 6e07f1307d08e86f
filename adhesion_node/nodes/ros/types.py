# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The message classes of rclpy, by the name of their type."""

from functools import cache
from importlib import import_module
from typing import Any


@cache
def message_class(type_name: str) -> type[Any]:
    """Return the class of a message type in ROS spelling."""
    package, _, name = type_name.split("/")
    found: type[Any] = getattr(import_module(f"{package}.msg"), name)
    return found


def new(type_name: str, /, **fields: Any) -> Any:
    """Make a message, or a part of one, for the codecs of `wire`."""
    return message_class(type_name)(**fields)

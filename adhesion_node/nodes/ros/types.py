# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The message classes of rclpy, by the name of their type."""

from functools import cache
from importlib import import_module
from typing import Any

from adhesion_node.command.without_ros import is_of_ros


@cache
def message_class(type_name: str) -> type[Any]:
    """Return the class of a message type in ROS spelling. Raises ValueError where the package of others is missing."""
    package, _, name = type_name.split("/")
    try:
        module = import_module(f"{package}.msg")
    except ModuleNotFoundError as error:
        if is_of_ros(package):
            raise
        missing = f"message type = {type_name}: {package} is missing: source the workspace that has it"
        raise ValueError(missing) from error
    found: type[Any] = getattr(module, name)
    return found


def new(type_name: str, /, **fields: Any) -> Any:
    """Make a message, or a part of one, for the codecs of `wire`."""
    return message_class(type_name)(**fields)

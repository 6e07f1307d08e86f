# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A machine without ROS: what to install, and stand-ins for its modules, so that --help and completion work."""

import os
import re
import sys
from abc import ABCMeta
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

REMEDY = "source /opt/ros/jazzy/setup.bash (apt install ros-jazzy-ros-base), or pip install '.[ros]' on x86-64"

_OF_ROS = re.compile(
    "rclpy|rmw_dds_common|std_srvs|(builtin|composition|rcl|rosbag2|type_description)_interfaces|"
    "(action|actionlib|diagnostic|geometry|lifecycle|nav|rosgraph|sensor|service|shape|statistics|std|stereo|tf2|"
    "trajectory|unique_identifier|visualization)_msgs"
)


def is_of_ros(module: str) -> bool:
    """Whether ROS itself brings a module; messages of others have names of the same form."""
    return _OF_ROS.fullmatch(module.partition(".")[0]) is not None


def is_help_asked() -> bool:
    """Whether the program is to answer for its options alone, before it asks anything of ROS."""
    return bool({"-h", "--help"} & set(sys.argv[1:])) or "_ARGCOMPLETE" in os.environ


class _Anything(ABCMeta):
    """A class, abstract or not, whose every attribute is that class again."""

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return StandIn


class StandIn(metaclass=_Anything):
    """In the place of any class or constant of ROS; it can be named and inherited from, no more."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        """Take whatever the class would."""


class _Finder(MetaPathFinder, Loader):
    """Gives empty modules whose names are all stand-ins."""

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        return ModuleSpec(fullname, self, is_package=True) if is_of_ros(fullname) else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = ModuleType(spec.name)
        # each name is a class of its own, as a class may inherit from several
        module.__dict__["__getattr__"] = cache(lambda name: _Anything(name, (StandIn,), {}))
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Nothing is to be done."""


@contextmanager
def stand_ins() -> Iterator[None]:
    """Let the modules of ROS be imported, of which nothing is used."""
    finder = _Finder()
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Definitions of types: of every ROS 2 the same, in both languages; a real difference is told."""

from __future__ import annotations

import pytest
from rosbags.typesys import Stores, get_typestore

from adhesion_node.bag import typestore
from adhesion_node.bag.definitions import difference
from adhesion_node.bag.types import Definition, definition
from adhesion_node.wire.topics import BRAKE_PRESSURE, DIAGNOSTICS, TOPICS

ROS_2 = [store for store in Stores if store.name.startswith("ROS2_")]

FLUID = BRAKE_PRESSURE.type
OF_FLUID = definition(FLUID).text

IDL = """================================================================================
IDL: sensor_msgs/msg/FluidPressure
// generated from rosidl_adapter/resource/msg.idl.em
#include "std_msgs/msg/Header.idl"

module sensor_msgs {
  module msg {
    @verbatim (language="comment", text="Single pressure reading." "\n" "Of a fluid.")
    struct FluidPressure {
      std_msgs::msg::Header header;
      @unit (value="Pascal")
      double fluid_pressure;
      double variance;
    };
  };
};

================================================================================
IDL: std_msgs/msg/Header
#include "builtin_interfaces/msg/Time.idl"

module std_msgs {
  module msg {
    struct Header {
      builtin_interfaces::msg::Time stamp;
      string frame_id;
    };
  };
};
"""


def test_every_type_is_as_it_is_written() -> None:
    assert {name: why for name in typestore().fielddefs if (why := difference(name, definition(name)))} == {}


@pytest.mark.parametrize("store", ROS_2)
def test_what_we_read_is_the_same_in_every_ros_2(store: Stores) -> None:
    theirs = get_typestore(store)
    for name in {topic.type for topic in TOPICS} & set(theirs.fielddefs):
        assert difference(name, Definition("ros2msg", theirs.generate_msgdef(name, ros_version=2)[0])) is None


def test_in_the_other_language_it_is_the_same() -> None:
    assert difference(FLUID, Definition("ros2idl", IDL)) is None
    other = difference(FLUID, Definition("ros2idl", IDL.replace("string frame_id;", "string frame_id; long seq;")))
    assert other is not None
    assert "std_msgs/msg/Header (its fields are builtin_interfaces/msg/Time stamp, string frame_id, int32 seq" in other


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("float64 fluid_pressure", "  float64   fluid_pressure  # Pascal\n\nint32 SOME=7"),
        ("string frame_id", "string<=64 frame_id"),
        ("float64 variance", "float64 variance 0.0"),
        ("builtin_interfaces/Time stamp", "builtin_interfaces/msg/Time stamp"),
        ("int32 sec", "{ no definition"),
        (OF_FLUID, ""),
        (OF_FLUID, f"string<={'9' * 5000} a"),
    ],
)
def test_what_moves_no_byte_or_is_not_known_is_no_difference(old: str, new: str) -> None:
    assert old in OF_FLUID
    assert difference(FLUID, Definition("ros2msg", OF_FLUID.replace(old, new))) is None


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("float64 variance", "float32 variance"),
        ("float64 variance", "float64[] variance"),
        ("float64 variance", "float64 stddev"),
        ("float64 variance", ""),
        ("float64 fluid_pressure\nfloat64 variance", "float64 variance\nfloat64 fluid_pressure"),
        ("uint32 nanosec", "uint64 nanosec"),
    ],
)
def test_a_field_that_is_another_is_told(old: str, new: str) -> None:
    assert old in OF_FLUID
    told = difference(FLUID, Definition("ros2msg", OF_FLUID.replace(old, new)))
    assert told is not None
    assert told.startswith("recorded with another definition of ")


def test_the_types_of_others_are_not_known() -> None:
    assert difference("foo_msgs/msg/Bar", Definition("ros2msg", "int32 baz")) is None
    assert difference(FLUID, Definition("protobuf", OF_FLUID)) is None
    alone = definition(DIAGNOSTICS.type).text.partition("====")[0]
    assert difference(DIAGNOSTICS.type, Definition("ros2msg", alone)) is None

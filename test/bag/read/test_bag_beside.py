# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Topics that are not ours, or not as ours are: they cost nothing of the others, and are left out with a word."""

from __future__ import annotations

import re
from pathlib import Path

import cdrs
import pytest
from recorded import JSON, NUMBER, PROTOBUF, TEXT, UNDEFINED, Beside, S, cdr_beside, write_beside

from adhesion_node.bag import BagReader, BagWriter, select_from
from adhesion_node.bag.types import Definition, definition
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION

OURS = ["/brake_pressure", "/position"] * 3


@pytest.mark.parametrize("beside", [JSON, PROTOBUF, UNDEFINED])
def test_what_is_no_cdr_is_left_out_and_told(tmp_path: Path, beside: Beside) -> None:
    with BagReader(write_beside(tmp_path / "x.mcap", beside)) as reader:
        assert [record.topic for record in reader.messages()] == OURS
        assert (reader.damage, reader.resolve("/log"), list(reader.messages(["/log"]))) == ((), None, [])
        why = f"topic /log: encoding = {beside.encoding!r}: only CDR (ROS 2) is read"
        assert reader.left_out == [f"{why}: 2 messages are left out"]
        assert set(select_from(reader, [])) == set(OURS)
        remedy = f"bag = {reader.path}: {why}: convert it, or leave it out by --remap /log:=unused"
        with pytest.raises(ValueError, match=re.escape(remedy)):
            select_from(reader, [], ["/log"])


@pytest.mark.parametrize(
    "beside",
    [PROTOBUF._replace(messages=()), Beside("/none", "cdr", TEXT, ("ros2msg", "string data # \xe9".encode("latin-1")))],
)
def test_a_schema_that_is_no_text_costs_no_chunk(tmp_path: Path, beside: Beside) -> None:
    with BagReader(write_beside(tmp_path / "x.mcap", beside)) as reader:
        assert [record.topic for record in reader.messages()] == OURS
        assert (reader.damage, reader.left_out) == ((), [])


def test_a_topic_of_two_types_is_refused_where_it_is_selected(tmp_path: Path) -> None:
    both = cdr_beside("/foo", TEXT, b"\0\1\0\0"), cdr_beside("/foo", NUMBER, bytes(12), bytes(12))
    with BagReader(write_beside(tmp_path / "x.mcap", *both)) as reader:
        assert [record.type for record in reader.messages() if record.topic == "/foo"] == [TEXT]
        assert reader.left_out == [f"topic /foo: recorded as {TEXT} and as {NUMBER}: 3 messages are left out"]
        assert set(select_from(reader, [])) == set(OURS)
        with pytest.raises(ValueError, match=r"topic /foo: recorded as .*: convert it, or leave it out by --remap"):
            select_from(reader, [], ["/foo"])


def test_a_topic_of_two_encodings_is_what_is_cdr_of_it(tmp_path: Path) -> None:
    both = JSON, cdr_beside("/log", TEXT, b"\0\1\0\0\1\0\0\0\0")
    with BagReader(write_beside(tmp_path / "x.mcap", *both)) as reader:
        assert reader.topics["/log"] == TEXT
        assert [record.message.data for record in reader.messages() if record.topic == "/log"] == [""]
        assert "only CDR" in reader.unread["/log"]


@pytest.mark.parametrize("encoding", ["json", "ros1"])
def test_a_recording_of_nothing_that_is_cdr_is_refused(tmp_path: Path, encoding: str) -> None:
    file = write_beside(tmp_path / "x.mcap", JSON._replace(encoding=encoding), steps=0)
    with pytest.raises(ValueError, match=rf"no readable message \(topic /log: encoding = '{encoding}': only CDR"):
        BagReader(file)


def test_a_topic_that_is_defined_otherwise_is_refused_where_it_is_selected(tmp_path: Path) -> None:
    text = definition(BRAKE_PRESSURE.type).text.replace("float64 fluid", "float64 temperature\nfloat64 fluid")
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/brake_pressure", BRAKE_PRESSURE.type, known_as=Definition("ros2msg", text))
        writer.write("/brake_pressure", BRAKE_PRESSURE.type, cdrs.brake_pressure(0, 3e5), 0)
        writer.write("/position", POSITION.type, cdrs.position(0, 0.0, 0.25), S)
    with BagReader(tmp_path / "bag") as reader:
        assert reader.resolve("brake_pressure") is None
        (said,) = reader.left_out
        assert said == (
            f"topic /brake_pressure: recorded with another definition of {BRAKE_PRESSURE.type} (its fields are "
            "std_msgs/msg/Header header, float64 temperature, float64 fluid_pressure, float64 variance, ours "
            "std_msgs/msg/Header header, float64 fluid_pressure, float64 variance): 1 messages are left out"
        )
        with pytest.raises(ValueError, match=r"convert it, or leave it out by --remap /brake_pressure:=unused$"):
            select_from(reader, [])
        assert set(select_from(reader, ["/brake_pressure:=unused"])) == {"/position"}


def test_a_later_file_of_another_definition_is_noticed(tmp_path: Path) -> None:
    """As where two recordings were put into one folder."""
    seq = definition(POSITION.type).text.replace("string frame_id", "uint32 seq\nstring frame_id")
    for number, text in enumerate(("", seq)):
        with BagWriter(tmp_path / str(number)) as writer:
            writer.add_topic("/position", POSITION.type, known_as=Definition("ros2msg", text))
            writer.write("/position", POSITION.type, cdrs.position(number * S, 0.0, 0.25), number * S)
        (tmp_path / str(number) / "bag_0.mcap").rename(tmp_path / f"bag_{number}.mcap")
    with BagReader(tmp_path) as reader:
        assert "another definition of std_msgs/msg/Header (its fields are" in reader.unread["/position"]

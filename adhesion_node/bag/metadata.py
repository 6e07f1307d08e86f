# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""metadata.yaml of rosbag2: written in version 9, as ROS 2 Jazzy does, and what is read of any version."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import yaml
from rosbags.interfaces import Qos

from .qos import profiles

VERSION = 9

LATEST_NS = 2**63 - 1
"""The last log time that rosbag2 holds."""

_ROOT = "rosbag2_bagfile_information"


class Topic(NamedTuple):
    """What the metadata says of a topic."""

    name: str
    type: str
    type_hash: str
    offered: tuple[Qos, ...]


class File(NamedTuple):
    """What the metadata says of a file: the time of its first message, how long it goes on, how many there are."""

    name: str
    first_ns: int
    duration_ns: int
    messages: int


class Metadata(NamedTuple):
    """What is read of the metadata: whether there is any, the files, messages by topic."""

    readable: bool = False
    files: tuple[str, ...] = ()
    messages: Mapping[str, int] = MappingProxyType({})


def read_metadata(bag: Path) -> Metadata:
    """Read the metadata in a directory; an empty one when it is missing or unreadable, as after an interruption."""
    try:
        information = yaml.safe_load((bag / "metadata.yaml").read_text(encoding="utf-8"))[_ROOT]
        return Metadata(
            True,
            tuple(Path(name).name for name in information.get("relative_file_paths") or ()),
            {
                str(entry["topic_metadata"]["name"]): int(entry["message_count"])
                for entry in information.get("topics_with_message_count") or ()
            },
        )
    except (OSError, ValueError, OverflowError, yaml.YAMLError, AttributeError, LookupError, TypeError, RecursionError):
        return Metadata()


def document(files: Sequence[File], topics: Sequence[tuple[Topic, int]]) -> str:
    """Return the text of metadata.yaml; each topic comes with its number of messages."""
    filled = [file for file in files if file.messages]
    first_ns = min((file.first_ns for file in filled), default=0)
    last_ns = max((file.first_ns + file.duration_ns for file in filled), default=0)
    information = {
        "version": VERSION,
        "storage_identifier": "mcap",
        **_period(first_ns, last_ns - first_ns),
        "message_count": sum(file.messages for file in files),
        "topics_with_message_count": [_topic(topic, messages) for topic, messages in topics],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file.name for file in files],
        "files": [
            {"path": file.name, **_period(file.first_ns, file.duration_ns), "message_count": file.messages}
            for file in files
        ],
        "custom_data": None,
        "ros_distro": "jazzy",
    }
    return yaml.safe_dump({_ROOT: information}, sort_keys=False)


def _period(first_ns: int, duration_ns: int) -> dict[str, dict[str, int]]:
    return {"duration": {"nanoseconds": duration_ns}, "starting_time": {"nanoseconds_since_epoch": first_ns}}


def _topic(topic: Topic, messages: int) -> dict[str, Any]:
    return {
        "topic_metadata": {
            "name": topic.name,
            "type": topic.type,
            "serialization_format": "cdr",
            "offered_qos_profiles": profiles(topic.offered),
            "type_description_hash": topic.type_hash,
        },
        "message_count": messages,
    }

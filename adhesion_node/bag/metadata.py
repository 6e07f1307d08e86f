"""metadata.yaml of rosbag2, version 9, as ROS 2 Jazzy writes it."""

from __future__ import annotations

from io import StringIO
from typing import Any, NamedTuple

from ruamel.yaml import YAML

VERSION = 9

FOREVER = {"sec": 9223372036, "nsec": 854775807}
"""How rosbag2 writes a duration that is not limited."""


class Topic(NamedTuple):
    """What the metadata says of a topic."""

    name: str
    type: str
    type_hash: str
    latched: bool


def qos_profiles(latched: bool) -> list[dict[str, Any]]:
    """Return the QoS that a player offers: reliable; with `latched` also transient local with depth 1."""
    return [
        {
            "history": "keep_last",
            "depth": 1 if latched else 100,
            "reliability": "reliable",
            "durability": "transient_local" if latched else "volatile",
            "deadline": dict(FOREVER),
            "lifespan": dict(FOREVER),
            "liveliness": "automatic",
            "liveliness_lease_duration": dict(FOREVER),
            "avoid_ros_namespace_conventions": False,
        }
    ]


def document(file_name: str, topics: list[tuple[Topic, int]], first_ns: int, duration_ns: int) -> str:
    """Return the text of metadata.yaml for one MCAP file; each topic comes with its number of messages."""
    count = sum(messages for _, messages in topics)
    information = {
        "version": VERSION,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": duration_ns},
        "starting_time": {"nanoseconds_since_epoch": first_ns},
        "message_count": count,
        "topics_with_message_count": [_topic(topic, messages) for topic, messages in topics],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file_name],
        "files": [
            {
                "path": file_name,
                "starting_time": {"nanoseconds_since_epoch": first_ns},
                "duration": {"nanoseconds": duration_ns},
                "message_count": count,
            }
        ],
        "custom_data": None,
        "ros_distro": "jazzy",
    }
    text = StringIO()
    YAML().dump({"rosbag2_bagfile_information": information}, text)
    return text.getvalue()


def _topic(topic: Topic, messages: int) -> dict[str, Any]:
    return {
        "topic_metadata": {
            "name": topic.name,
            "type": topic.type,
            "serialization_format": "cdr",
            "offered_qos_profiles": qos_profiles(topic.latched),
            "type_description_hash": topic.type_hash,
        },
        "message_count": messages,
    }

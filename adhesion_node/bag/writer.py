"""Writes a recording: a rosbag2 directory with one MCAP file and metadata.yaml beside it."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from mcap.writer import CompressionType, Writer

from .metadata import Topic, document, qos_profiles
from .types import Definition, definition, type_hash

CHUNK_BYTES = 64 * 1024
"""Size of a chunk before compression: what an interruption between two flushes can cost."""

FILE_NAME = "bag_0.mcap"
"""Not named after the directory: a recording may be renamed, and equal recordings are equal byte by byte."""

LATEST_NS = 2**63 - 1


@dataclass
class _Channel:
    id: int
    topic: Topic
    count: int = 0


class BagWriter:
    """Writes messages into a new directory; a context manager. Equal messages give equal files.

    Nothing but what is passed in is written, the clock is not read. Until `close` (or when the process dies) the
    directory holds an MCAP file without index and metadata, which `BagReader` reads up to the last `flush` or full
    chunk. Raises ValueError when the directory exists.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        if self.path.exists():
            raise ValueError(f"output = {str(self.path)!r}: it exists already, give the name of a new directory")
        self.path.mkdir(parents=True)
        self._file = (self.path / FILE_NAME).open("xb")
        # Any: mcap annotates its writer only in part.
        self._writer: Any = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library="adhesion_node")
        self._file.flush()
        self._channels: dict[str, _Channel] = {}
        self._schemas: dict[str, int] = {}
        self._first_ns = LATEST_NS
        self._last_ns = 0

    def add_topic(
        self, name: str, type_name: str, *, latched: bool = False, known_as: Definition | None = None
    ) -> None:
        """Announce a topic; `write` does so itself where the defaults fit. Announcing again changes nothing.

        `latched` topics are marked transient local. `known_as` defines a type that is not part of ROS 2 Jazzy.
        Raises ValueError when the type is unknown.
        """
        if name in self._channels:
            return
        if type_name not in self._schemas:
            encoding, text = known_as if known_as and known_as.text else definition(type_name)
            self._schemas[type_name] = self._writer.register_schema(type_name, encoding, text.encode())
        topic = Topic(name, type_name, type_hash(type_name), latched)
        # JSON is YAML as well, and rosbag2 wants YAML here.
        qos = {"offered_qos_profiles": json.dumps(qos_profiles(latched)), "topic_type_hash": topic.type_hash}
        channel = self._writer.register_channel(name, "cdr", self._schemas[type_name], qos)
        self._channels[name] = _Channel(channel, topic)

    def write(self, topic_name: str, type_name: str, cdr: bytes, log_ns: int) -> None:
        """Append one message. Raises ValueError when the topic has another type or the time is out of range."""
        self.add_topic(topic_name, type_name)
        channel = self._channels[topic_name]
        if channel.topic.type != type_name:
            raise ValueError(f"topic {topic_name}: type = {type_name}: the recording holds it as {channel.topic.type}")
        if not 0 <= log_ns <= LATEST_NS:
            raise ValueError(f"topic {topic_name}: log time = {log_ns} ns: give nanoseconds from 0 to 2^63 - 1")
        self._writer.add_message(channel.id, log_time=log_ns, data=cdr, publish_time=log_ns)
        channel.count += 1
        self._first_ns = min(self._first_ns, log_ns)
        self._last_ns = max(self._last_ns, log_ns)

    @property
    def counts(self) -> dict[str, int]:
        """Messages written so far by topic."""
        return {name: channel.count for name, channel in self._channels.items()}

    def flush(self) -> None:
        """Hand everything written so far to the operating system: it survives the death of this process."""
        self._writer.flush()

    def close(self) -> None:
        """Write the index and metadata.yaml; closing again does nothing."""
        if self._file.closed:
            return
        self._writer.finish()
        self._file.close()
        topics = [(channel.topic, channel.count) for channel in self._channels.values()]
        first_ns = min(self._first_ns, self._last_ns)
        text = document(FILE_NAME, topics, first_ns, self._last_ns - first_ns)
        (self.path / "metadata.yaml").write_text(text, encoding="utf-8")

    def discard(self) -> None:
        """Close and delete the directory: nothing of a failed conversion is left."""
        self._file.close()
        shutil.rmtree(self.path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

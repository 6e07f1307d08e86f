# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which topics of a recording stand for which of ours: whose train, remapping, and clear words when they do not fit."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType

from ..wire import topics
from ..wire.topic import Topic
from .read.reader import BagReader
from .types import same_name

_OURS = {topic.name: topic.type for topic in (*topics.SENSORS, *topics.TRUTH)}

_ENOUGH = (*topics.POSITIONS, topics.SPEED, topics.WHEEL_SPEED)
"""Without any of these a recording has nothing to replay."""

_TELLING = (topics.BRAKE_PRESSURE, topics.SPEED, topics.IMU, topics.WHEEL_SPEED)
"""What is missed, beside a position, where a recording has it under another name."""

_FORCES = (topics.BRAKE_PRESSURE, topics.BRAKE_DEMAND, topics.TRACTION_FORCE)


def parse_remap(text: str) -> tuple[str, str]:
    """Split "FROM:=TO" into the two topic names.

    >>> parse_remap("/odometry/position:=position")
    ('/odometry/position', 'position')
    """
    source, separator, target = text.partition(":=")
    if not (separator and source.strip("/") and target.strip("/")) or ":=" in target:
        raise ValueError(f"remap = {text!r}: write FROM:=TO, for instance /odometry/position:=position")
    return source, target


def choose_train(reader: BagReader, wanted: str | None, *, remapped: bool = False) -> None:
    """Read from now on the train of the namespace `wanted`; without one that in none, or else the only one there is.

    Raises ValueError where the recording lacks the train, or the choice is open, unless remaps make it.
    """
    trains = _trains(reader.topics)
    if wanted is not None:
        reader.namespace = f"/{wanted.strip('/')}".rstrip("/")
        if not any(name.startswith(f"{reader.namespace}/") for name in reader.topics):
            known = ", ".join(trains) or "none"
            raise ValueError(f"namespace = {wanted}: not in the recording {reader.path}: choose of {known}")
    elif trains and "" not in trains:
        if len(trains) > 1:
            if remapped:
                return
            each = ", ".join(trains)
            raise ValueError(f"bag = {reader.path}: holds the trains {each}: choose one, --namespace {trains[0]}")
        (reader.namespace,) = trains


def _trains(recorded: Mapping[str, str]) -> list[str]:
    """Namespaces that hold an adhesion, or a place or speed with a force; without a namespace these are enough."""
    held: dict[str, set[str]] = {}
    for name, kind in recorded.items():
        for topic in (*_ENOUGH, *_FORCES, topics.MU):
            space, found, _ = f"/{name.lstrip('/')}".rpartition(f"/{topic.name}")
            if found and topic.type == kind and name.endswith(topic.name):
                held.setdefault(space, set()).add(topic.name)
    enough, forces = ({topic.name for topic in each} for each in (_ENOUGH, _FORCES))
    return sorted(
        space for space, has in held.items() if topics.MU.name in has or (has & enough and (has & forces or not space))
    )


def select(
    recorded: Mapping[str, str],
    remaps: Sequence[tuple[str, str]] = (),
    names: Iterable[str] | None = None,
    namespace: str = "",
    unread: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """Return the topics to replay: from the name in the recording to the name after remapping.

    `recorded` holds the types by name. Replayed are `names` (after remapping), or else the sensors and the truth,
    not recorded results; of several trains that of `namespace`. Our own topics come out under their relative names, so
    that namespaces apply. Raises ValueError when a remapped or named topic is missing, has the wrong type, when one is
    `unread`, which says why, or when there is neither a position nor a speed nor, for the creep curve, a wheel speed.
    """
    renamed = _rename(recorded, remaps, namespace)
    has_any = any(same_name(target, topic.name) for target in renamed.values() for topic in _ENOUGH)
    chosen = list(_OURS) if names is None else list(names)
    selection: dict[str, str] = {}
    for name in chosen:
        source = next((source for source, target in renamed.items() if same_name(target, name)), None)
        own = name.lstrip("/")
        if source is not None:
            if source in unread:
                raise ValueError(f"{unread[source]}: convert it, or leave it out by --remap {source}:=unused")
            selection[source] = own if own in _OURS else name
            if (kind := recorded[source]) != (needed := _OURS.get(own, kind)):
                what = _what_there_is(name, recorded)
                if needed not in recorded.values():
                    what = f"Convert it, or leave it out: --remap {source}:=unused"
                raise ValueError(f"topic {source}: type = {kind}: {name} needs {needed}. {what}")
        elif names is not None or (same_name(name, topics.POSITION.name) and not has_any):
            raise ValueError(f"topic {name}: not in the recording. {_what_there_is(name, recorded)}")
    return selection


def select_from(
    reader: BagReader, remaps: Sequence[str], names: Iterable[str] | None = None, namespace: str | None = None
) -> dict[str, str]:
    """Select as `select` does from a recording, by remaps in their written form; errors name the recording.

    The train is chosen as by `choose_train`, unless topics are named and no namespace is.
    """
    if not reader.topics:
        raise ValueError(f"bag = {reader.path}: holds no message: name another recording")
    if namespace is not None or names is None:
        choose_train(reader, namespace, remapped=bool(remaps))
    try:
        return select(reader.topics, [parse_remap(text) for text in remaps], names, reader.namespace, reader.unread)
    except ValueError as error:
        raise ValueError(f"bag = {reader.path}: {error}") from error


def left_out(reader: BagReader, selection: Mapping[str, str]) -> Iterator[str]:
    """Say what of a recording is not read, and what could be: to be heard by whoever has it replayed."""
    yield from reader.left_out
    yield from overlooked(reader.topics, selection, reader.namespace)


def overlooked(recorded: Mapping[str, str], selection: Mapping[str, str], namespace: str = "") -> Iterator[str]:
    """Say which topics under other names could be sensors that a selection lacks, each with its remapping."""
    own = {f"{space}/{topic.name}".lstrip("/") for topic in topics.TOPICS for space in ("", namespace)}
    trains = tuple(f"{space}/" for space in _trains(recorded) if space not in ("", namespace))
    free = {
        name: kind
        for name, kind in sorted(recorded.items())
        if name not in selection and name.lstrip("/") not in own and not f"/{name.lstrip('/')}".startswith(trains)
    }
    read = set(selection.values())
    lacking: list[tuple[str, tuple[Topic, ...]]] = [
        (topic.name, (topic,)) for topic in _TELLING if topic.name not in read
    ]
    if not any(topic.name in read for topic in topics.POSITIONS):
        lacking.insert(0, (topics.POSITION.name, topics.POSITIONS))
    for what, wanted in lacking:
        if found := [(name, topic.name) for name, kind in free.items() for topic in wanted if topic.type == kind]:
            listed = ", ".join(f"{name} ({recorded[name]})" for name, _ in found)
            yield f"no {what} is read; could it be {listed}? --remap {':='.join(found[0])}"


def _rename(recorded: Mapping[str, str], remaps: Sequence[tuple[str, str]], namespace: str) -> dict[str, str]:
    """Return the name after remapping by recorded name; what a remapping displaces, or others have, is left out."""
    renamed = {}
    for source, target in remaps:
        match = next((name for name in recorded if same_name(name, source)), None)
        if match is None:
            raise ValueError(f"remap from {source}: not in the recording. {_what_there_is(target, recorded)}")
        renamed[match] = target
    taken = {target.lstrip("/") for target in renamed.values()}
    own = {name: name.removeprefix(namespace) for name in recorded if not namespace or name.startswith(f"{namespace}/")}
    return renamed | {
        name: target for name, target in own.items() if name not in renamed and target.lstrip("/") not in taken
    }


def _what_there_is(name: str, recorded: Mapping[str, str]) -> str:
    """List the recording's topics and show a remapping: from a topic of the right type where there is one.

    Of a position, which others stand in for, it is that of one of these.
    """
    listed = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(recorded.items())) or "none"
    own = name.lstrip("/")
    places = _ENOUGH if own == topics.POSITION.name else ()
    made = tuple(f"/{topic.name}" for topic in topics.TOPICS if topic not in topics.SENSORS)  # by us, of no sensor
    for ours in (own, *(topic.name for topic in places)):
        for topic, kind in sorted(recorded.items()):
            if kind == _OURS.get(ours) and not f"/{topic}".endswith(made):
                return f"It holds: {listed}. Name the right one, for instance --remap {topic}:={ours}"
    if places:
        return f"It holds: {listed}. No type of these tells where or how fast it runs: write a CSV for import_csv"
    return f"It holds: {listed}. Name the right one, for instance --remap /recorded/name:={own}"

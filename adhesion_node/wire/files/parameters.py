# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""ROS parameter files: whom their sections are for, and what they give an offline estimator.

A section is for the nodes that its name matches: `*` stands for one part of a fully qualified name, `**` for any
number of them, and a name without namespace for the node in the root. Of several sections for a node the later one
wins, parameter by parameter, as in ROS.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import yaml

OF_EVERY_NODE = ("use_sim_time", "start_type_description_service", "qos_overrides.")
"""Parameters that ROS itself gives to every node: they may stand in a parameter file and mean nothing here."""

_FILE = "--params-file"

_WILDCARDS = {"*": r"/\w+", "**": r"(/\w+)*"}


class _Loader(yaml.SafeLoader):
    """YAML as ROS reads it: 1e-6 is a number."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"), [*"-+.0123456789"]
)


class _Once(_Loader):
    """No key may stand twice: else the last one would count, without a word."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for index, key in enumerate(keys):
            if key in keys[:index]:
                line = node.value[index][0].start_mark.line + 1
                raise ValueError(f"{key} stands in line {line} once more: leave one out")
        return super().construct_mapping(node, deep)


class Section(NamedTuple):
    """Parameters by name, and the name of the nodes that they are for; nested namespaces are joined."""

    name: str
    values: dict[str, Any]


def read(path: str, node: str) -> dict[str, Any]:
    """Parameters of a node in a file; ValueError when it is unreadable or not for that node.

    `node` is a fully qualified name such as /train1/estimator, or a bare name. A bare one is any node of that name,
    as long as the file gives all that it names the same values.
    """
    found = sections(path)
    nodes = _meant(found, node)
    if not nodes:
        listed, bare = ", ".join(one.name for one in found), node.rpartition("/")[2]
        raise ValueError(f"params = {path}: has {listed or 'nobody'}: name the node '{bare}' or '/**'")
    results = [_values(found, one) for one in nodes]
    if any(result != results[0] for result in results):
        listed = " and ".join(nodes)
        raise ValueError(f"params = {path}: gives {listed} other values: say whose you want, --node {nodes[0]}")
    return {name: value for name, value in results[0].items() if not name.startswith(OF_EVERY_NODE)}


def unheeded(ros_arguments: Sequence[str], node: str) -> list[str]:
    """Return one message for every --params-file without a section for `node`, and for every value that is shadowed.

    ROS ranks by where a section's name is first mentioned, of all files and of `-p`, which is the section `/**`: `-p`
    after a file gives way to it where an earlier `-p`, or the file itself, has mentioned `/**` before. The arguments
    are those that ROS has read already, so they are well formed and the files there. In a file it finds no parameters
    where all is commented out, or where it is no parameter file at all: of that one message says so.
    """
    try:
        given = list(_given(ros_arguments))
    except ValueError as error:
        return [str(error)]
    named = f"name one '{node.rpartition('/')[2]}' or '/**'"
    useless = [
        f"{source}: has sections for {', '.join(one.name for one in found) or 'nobody'}, none for {node}: {named}"
        for source, found in given
        if source.startswith(_FILE) and not any(is_for(one.name, node) for one in found)
    ]
    wanted: dict[str, tuple[str, Any]] = {}
    merged: dict[str, dict[str, Any]] = {}
    for source, found in given:
        for one in found:
            merged.setdefault(one.name, {}).update(one.values)
            if is_for(one.name, node):
                wanted |= {name: (source, value) for name, value in one.values.items()}
    effective = _values([Section(*one) for one in merged.items()], node)
    return useless + [
        f"{source}: {name} = {value} is shadowed, {effective[name]} holds: give every --params-file before the first "
        "-p, and in files the section /** last"
        for name, (source, value) in wanted.items()
        if effective[name] != value
    ]


def without_value(ros_arguments: Sequence[str]) -> Iterator[str]:
    """Say of every parameter that is given without a value that it is, which keeps ROS from making any node it is for.

    The arguments are those of `unheeded`.
    """
    for source, found in _given(ros_arguments):
        for name, value in (each for one in found for each in one.values.items()):
            if value in ({}, []):
                yield f"{source}: {name} = {value}: give a value, or leave it out"


def _given(ros_arguments: Sequence[str]) -> Iterator[tuple[str, list[Section]]]:
    """Yield what gives parameters, as it stands on the command line, with its sections."""
    for option, text in pairwise(ros_arguments):
        if option == _FILE:
            yield f"{option} {text}", sections(text)
        elif option in ("-p", "--param"):
            rule, _, value = text.partition(":=")
            whose, _, name = rule.rpartition(":")
            yield f"{option} {text}", [Section(whose.lstrip("/") or "**", {name: _value(value)})]


def _value(text: str) -> Any:
    try:
        return yaml.load(text, _Loader)
    except yaml.YAMLError:
        return text


def text_of(node: str, values: Mapping[str, Any]) -> str:
    """The parameters of a node as the text of such a file.

    >>> print(text_of("estimator", {"seed": 1}))
    estimator:
      ros__parameters:
        seed: 1
    <BLANKLINE>
    """
    text: str = yaml.safe_dump({node: {"ros__parameters": dict(values)}}, allow_unicode=True, sort_keys=False)
    return text


def load(path: str, *, once: bool = False) -> Any:
    """What a YAML file holds, where a key may stand `once` only, or again.

    Raises OSError, ValueError or YAMLError where it is not readable.
    """
    return yaml.load(Path(path).read_text(encoding="utf-8"), _Once if once else _Loader)


def sections(path: str) -> list[Section]:
    """Return the sections of a file in their order; ValueError when it is no readable parameter file."""
    try:
        return list(_named(load(path), ""))
    except (OSError, ValueError, yaml.YAMLError, AttributeError, LookupError, TypeError, RecursionError) as error:
        raise ValueError(f"params = {path}: not a readable ROS parameter file: {_why(error)}") from error


def _why(error: Exception) -> str:
    if isinstance(error, OSError):
        return f"{error.strerror}: name a file"
    mark = getattr(error, "problem_mark", None)
    if mark is not None:
        return f"line {mark.line + 1}: {getattr(error, 'problem', error)}"
    if isinstance(error, AttributeError | LookupError | TypeError):
        return "it is to hold, one in the other, NODE: ros__parameters: NAME: VALUE"
    return type(error).__name__


def is_for(section: str, node: str) -> bool:
    """Whether a section is for the node, a fully qualified name.

    >>> [is_for(section, "/train1/estimator") for section in ("/**", "estimator", "/*/estimator", "train1/estimator")]
    [True, False, True, True]
    """
    parts = section.strip("/").split("/")
    return re.fullmatch("".join(_WILDCARDS.get(part, f"/{re.escape(part)}") for part in parts), node) is not None


def _values(found: Sequence[Section], node: str) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for section in found:
        if is_for(section.name, node):
            values |= section.values
    return values


def _meant(found: Sequence[Section], node: str) -> list[str]:
    """Return the nodes for which the file has something: those it spells out, or else one for each of its patterns."""
    if node.startswith("/"):
        return [node] if any(is_for(section.name, node) for section in found) else []
    ranked: dict[int, list[str]] = {}
    for section in found:
        parts = section.name.strip("/").split("/")
        *namespace, last = parts
        if last in (node, "*", "**"):
            spelled = ["any" if part == "*" else part for part in (*namespace, node) if part != "**"]
            ranked.setdefault(2 if "**" in parts else int("*" in parts), []).append("/" + "/".join(spelled))
    return list(dict.fromkeys(ranked[min(ranked)])) if ranked else []


def _named(content: Mapping[str, Any], name: str) -> Iterator[Section]:
    for key, value in content.items():
        if key == "ros__parameters":
            yield Section(name, _flat(value))
        else:
            yield from _named(value, f"{name}/{str(key).strip('/')}".lstrip("/"))


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Parameter names as ROS spells them: `train: {mass_kg: 1}` is `train.mass_kg`; an empty group is a value."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        flat |= _flat(value, f"{prefix}{name}.") if isinstance(value, Mapping) and value else {f"{prefix}{name}": value}
    return flat

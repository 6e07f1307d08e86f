# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Notices a parameter file that is meant for other nodes: ROS passes over it without a word."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

_WILDCARDS = {"*": r"/\w+", "**": r"(/\w+)*"}


def unheeded(ros_arguments: Sequence[str], node: str) -> list[str]:
    """Return one message for every --params-file that has no section for `node`, a fully qualified name.

    The files are those that ROS has read already, so they are there and in order.
    """
    files = [file for option, file in pairwise(ros_arguments) if option == "--params-file"]
    return [
        f"--params-file {file}: has sections for {', '.join(sections) or 'nobody'}, none for {node}: "
        f"name one '{node.rpartition('/')[2]}' or '/**'"
        for file, sections in ((file, sections_of(file)) for file in files)
        if not any(is_for(section, node) for section in sections)
    ]


def sections_of(file: str) -> list[str]:
    """Return the nodes that a parameter file names, as it names them."""
    document = YAML(typ="safe").load(Path(file).read_text(encoding="utf-8"))
    return list(_named(document, ""))


def is_for(section: str, node: str) -> bool:
    """Whether a section is for the node, a fully qualified name; `*` stands for one part of it, `**` for any number.

    >>> [is_for(section, "/train1/estimator") for section in ("/**", "estimator", "/*/estimator", "train1/estimator")]
    [True, False, True, True]
    """
    parts = section.strip("/").split("/")
    return re.fullmatch("".join(_WILDCARDS.get(part, f"/{re.escape(part)}") for part in parts), node) is not None


def _named(content: Any, name: str) -> Iterator[str]:
    """Yield the names under which parameters stand; namespaces may be nested."""
    for key, value in content.items() if isinstance(content, dict) else ():
        if key == "ros__parameters":
            yield name
        else:
            yield from _named(value, f"{name}/{str(key).strip('/')}".lstrip("/"))

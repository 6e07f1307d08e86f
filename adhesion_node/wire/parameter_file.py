# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Settings of an offline estimator from a ROS parameter file and the command line."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from ..core.setting import Setting
from .settings import parse_setting

OF_EVERY_NODE = ("use_sim_time", "start_type_description_service", "qos_overrides.")
"""Parameters that ROS itself gives to every node: they may stand in a parameter file and mean nothing here."""


def given(options: argparse.Namespace, node: str, settings: Sequence[Setting]) -> dict[str, Any]:
    """Values of `--params` and, before them, of `--set`, by name; ValueError when one cannot be read."""
    values = read(options.params, node) if options.params else {}
    return values | dict(parse_setting(text, settings) for text in options.set)


def read(path: str, node: str) -> dict[str, Any]:
    """Settings of a node in a ROS parameter file; ValueError when it is unreadable or not for that node."""
    try:
        document = YAML(typ="safe").load(Path(path).read_text(encoding="utf-8"))
        nodes = {name.strip("/"): _flat(content["ros__parameters"]) for name, content in document.items()}
    except (OSError, UnicodeDecodeError, YAMLError, AttributeError, LookupError, TypeError) as error:
        raise ValueError(f"params = {path}: not a readable ROS parameter file ({type(error).__name__})") from error
    if node not in nodes and "**" not in nodes:
        raise ValueError(f"params = {path}: has {', '.join(nodes)}: name the node '{node}' or '/**'")
    values = {**nodes.get("**", {}), **nodes.get(node, {})}
    return {name: value for name, value in values.items() if not name.startswith(OF_EVERY_NODE)}


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Parameter names as ROS spells them: `train: {mass_kg: 1}` is `train.mass_kg`."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        flat |= _flat(value, f"{prefix}{name}.") if isinstance(value, Mapping) else {f"{prefix}{name}": value}
    return flat

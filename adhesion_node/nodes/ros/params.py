# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Settings as ROS parameters: typed, with ranges, checked as a whole before the node does anything."""

import math
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.setting import Setting

_INT64_MAX = 2**63 - 1

_USE_SIM_TIME = Setting("use_sim_time", False, "Follow /clock")
_OF_RCLPY = ("use_sim_time", "start_type_description_service")
_OF_RCLPY_QOS = "qos_overrides."


Preset = Callable[[Sequence[Setting], Mapping[str, Any]], Sequence[Setting]]
"""Settings whose defaults hold where a node was given some values."""


def descriptor(setting: Setting) -> ParameterDescriptor:
    """Describe a setting to `ros2 param describe` and to graphical tools."""
    described = ParameterDescriptor(
        description=f"{setting.description} [{setting.unit}]" if setting.unit else setting.description,
        additional_constraints=f"{setting.allowed()}; fixed at start",
        # A static type would refuse an integer for a float before `check` can accept it.
        dynamic_typing=True,
    )
    if not setting.is_number or (math.isinf(setting.low) and math.isinf(setting.high)):
        return described
    if isinstance(setting.default, float):
        floats = FloatingPointRange(from_value=float(setting.low), to_value=float(setting.high))
        described.floating_point_range = [floats]
    else:
        low, high = max(setting.low, -_INT64_MAX), min(setting.high, _INT64_MAX)
        described.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    return described


def declare(node: Node, settings: Sequence[Setting], preset: Preset | None = None) -> dict[str, Any]:
    """Declare every setting as a parameter of `node` and return the effective values as plain Python ones.

    `preset` changes defaults by what the node was given, a train's file for one. All values are checked before the
    first is accepted; a bad one raises ValueError with name, value and what is allowed. Afterwards a change is refused:
    a configuration holds for a whole run. The effective configuration is logged once. Construct the node with
    `automatically_declare_parameters_from_overrides=True`: then parameters that it was given but does not have are
    logged as well.
    """
    if node.has_parameter(_USE_SIM_TIME.name):
        _USE_SIM_TIME.check(node.get_parameter(_USE_SIM_TIME.name).value)
    given = {one.name: node.get_parameter(one.name).value for one in settings if node.has_parameter(one.name)}
    settings = settings if preset is None else preset(settings, given)
    values = {setting.name: setting.check(_given(node, setting)) for setting in settings}
    for setting in settings:
        node.set_descriptor(setting.name, descriptor(setting))
    node.set_parameters([Parameter(name, value=value) for name, value in values.items()])
    allowed = {setting.name: setting.allowed() for setting in settings}
    node.add_on_set_parameters_callback(lambda changes: _refuse(changes, allowed))
    for message in unknown(node, settings):
        node.get_logger().warning(message)
    node.get_logger().info("parameters: " + ", ".join(f"{name} = {value}" for name, value in values.items()))
    return values


def unknown(node: Node, settings: Sequence[Setting]) -> list[str]:
    """Return one message for each parameter that was given to `node` but that it does not have: a typo, as a rule.

    Only a warning: `-p` and the wildcard `/**` of a YAML file reach every node of a process.
    """
    names = [setting.name for setting in settings]
    return [
        f"{name} = {node.get_parameter(name).value!r}: {node.get_name()} has no such parameter{_hint(name, names)}"
        for name in node.list_parameters([], 0).names
        if not name.startswith(_OF_RCLPY_QOS) and name not in (*names, *_OF_RCLPY)
    ]


def _given(node: Node, setting: Setting) -> object:
    if node.has_parameter(setting.name):  # declared from what the node was given
        return node.get_parameter(setting.name).value
    return node.declare_parameter(setting.name, setting.default, ParameterDescriptor(dynamic_typing=True)).value


def _refuse(changes: Sequence[Parameter], allowed: Mapping[str, str]) -> SetParametersResult:
    """Refuse all changes together when one of them is to what `allowed` says of every parameter fixed at start."""
    refused = [
        f"{change.name} = {change.value}: fixed at start; restart the node to change it, with {allowed[change.name]}"
        for change in changes
        if change.name in allowed
    ]
    return SetParametersResult(successful=not refused, reason="; ".join(refused))


def _hint(name: str, names: Sequence[str]) -> str:
    close = get_close_matches(name, names, n=1)
    return f"; did you mean {close[0]}?" if close else ""

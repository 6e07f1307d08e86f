# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters from one table per node: typed, with ranges, checked as a whole before the node does anything."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.setting import Setting

Value = bool | int | float | str

_INT64_MAX = 2**63 - 1
_NUMBER = {float: "a finite number", int: "an integer"}

_OF_RCLPY = ("use_sim_time", "start_type_description_service")
_OF_RCLPY_QOS = "qos_overrides."


@dataclass(frozen=True, slots=True)
class Spec:
    """A parameter: the type of `default` is its type; `minimum` and `maximum` are allowed values themselves.

    `unit` is for people (empty for a plain number); `choices` restricts a string. Raises ValueError when the
    default breaks its own rule.
    """

    name: str
    default: Value
    description: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self.check(self.default)

    def check(self, value: object) -> Value:
        """Return `value` as this parameter's type, an integer for a float included; ValueError says what is allowed.

        >>> Spec("gain", 0.5, "a gain", maximum=1.0).check(1)
        1.0
        """
        kind = type(self.default)
        if kind is float and type(value) is int:
            value = float(value)
        if type(value) is not kind or not self._within(value):
            raise ValueError(f"{self.name} = {value!r}: give {self.allowed()}")
        return value

    def allowed(self) -> str:
        """Say in words what the parameter takes.

        >>> Spec("rate_hz", 10.0, "samples per second", "Hz", minimum=0.1, maximum=100.0).allowed()
        'a finite number between 0.1 and 100 Hz'
        """
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        kind = type(self.default)
        if kind not in _NUMBER:
            return "true or false" if kind is bool else "a text"
        low, high = self.minimum, self.maximum
        if low is None and high is None:
            limits = ""
        elif high is None:
            limits = f" of at least {low:.12g}"
        elif low is None:
            limits = f" of at most {high:.12g}"
        else:
            limits = f" between {low:.12g} and {high:.12g}"
        return f"{_NUMBER[kind]}{limits} {self.unit}".rstrip()

    def descriptor(self) -> ParameterDescriptor:
        """Describe the parameter to `ros2 param describe` and to graphical tools."""
        described = ParameterDescriptor(
            description=f"{self.description} [{self.unit}]" if self.unit else self.description,
            additional_constraints=f"{self.allowed()}; fixed at start",
            # A static type would refuse an integer for a float before `check` can accept it.
            dynamic_typing=True,
        )
        if self.minimum is None and self.maximum is None:
            return described
        if isinstance(self.default, float):
            low = -math.inf if self.minimum is None else float(self.minimum)
            high = math.inf if self.maximum is None else float(self.maximum)
            described.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
        else:
            least = -_INT64_MAX if self.minimum is None else int(self.minimum)
            most = _INT64_MAX if self.maximum is None else int(self.maximum)
            described.integer_range = [IntegerRange(from_value=least, to_value=most)]
        return described

    def _within(self, value: Any) -> bool:
        if self.choices:
            return value in self.choices
        if type(value) not in _NUMBER:
            return True
        low, high = self.minimum, self.maximum
        return math.isfinite(value) and (low is None or value >= low) and (high is None or value <= high)


def spec_of(setting: Setting) -> Spec:
    """Return the ROS parameter of a setting."""
    number = not isinstance(setting.default, (str, bool))
    low, high = (limit if number and math.isfinite(limit) else None for limit in (setting.low, setting.high))
    return Spec(setting.name, setting.default, setting.description, setting.unit, low, high, setting.choices)


def declare(node: Node, specs: Sequence[Spec]) -> dict[str, Any]:
    """Declare every parameter of `specs` on `node` and return the effective values as plain Python ones.

    All values are checked before the first is accepted; a bad one raises ValueError with name, value and what is
    allowed. Afterwards a change is refused: a configuration holds for a whole run. The effective configuration is
    logged once. Construct the node with `automatically_declare_parameters_from_overrides=True`: then the
    parameters it was given but does not have are logged as well.
    """
    if node.has_parameter("use_sim_time"):
        Spec("use_sim_time", False, "follow /clock").check(node.get_parameter("use_sim_time").value)
    values = {spec.name: spec.check(_given(node, spec)) for spec in specs}
    for spec in specs:
        node.set_descriptor(spec.name, spec.descriptor())
    node.set_parameters([Parameter(name, value=value) for name, value in values.items()])
    allowed = {spec.name: spec.allowed() for spec in specs}
    node.add_on_set_parameters_callback(lambda changes: _refuse(changes, allowed))
    for message in unknown(node, specs):
        node.get_logger().warning(message)
    node.get_logger().info("parameters: " + ", ".join(f"{name} = {value}" for name, value in values.items()))
    return values


def unknown(node: Node, specs: Sequence[Spec]) -> list[str]:
    """Return one message for each parameter that was given to `node` but that it does not have: a typo, as a rule.

    Only a warning: `-p` and the wildcard `/**` of a YAML file reach every node of a process.
    """
    names = [spec.name for spec in specs]
    return [
        f"{name} = {node.get_parameter(name).value!r}: {node.get_name()} has no such parameter{_hint(name, names)}"
        for name in node.list_parameters([], 0).names
        if not name.startswith(_OF_RCLPY_QOS) and name not in (*names, *_OF_RCLPY)
    ]


def _given(node: Node, spec: Spec) -> object:
    if node.has_parameter(spec.name):  # declared from what the node was given
        return node.get_parameter(spec.name).value
    return node.declare_parameter(spec.name, spec.default, ParameterDescriptor(dynamic_typing=True)).value


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

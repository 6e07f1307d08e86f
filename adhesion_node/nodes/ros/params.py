# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Settings as ROS parameters: typed, with ranges, checked as a whole before the node does anything.

Most are fixed at start, as a configuration holds for a whole run; some may change while the node runs, all that are
changed together or none.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.setting import Setting
from adhesion_node.wire.topics import TOPICS

from .guarded import GuardedNode

_INT64_MAX = 2**63 - 1

_USE_SIM_TIME = Setting("use_sim_time", False, "Follow /clock")
_OF_RCLPY = ("use_sim_time", "start_type_description_service")
_OF_RCLPY_QOS = "qos_overrides."
_QOS = re.compile(r"qos_overrides\.(.+)\.(?:publisher|subscription)(?:_\w+)?\.\w+")


Preset = Callable[[Sequence[Setting], Mapping[str, Any]], Sequence[Setting]]
"""Settings whose defaults hold where a node was given some values."""

FIXED = "fixed at start"

Change = Callable[[Mapping[str, Any]], Callable[[], None]]
"""Takes all values, the new ones among them; ValueError where they do not fit. Returns what puts them in force."""


class SettingsNode(GuardedNode):
    """A node whose parameters are settings: those that it has already it accepts, whether or not they may change."""

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters together, an integer or a text such as 1e-06 for a float included, or none of them."""
        changes = [change for change in map(self._typed, parameter_list) if not self._has(change)]
        refused = [refusal for refusal in map(self._refusal, changes) if refusal]
        if refused or not changes:
            return SetParametersResult(successful=not refused, reason="; ".join(refused))
        result: SetParametersResult = super().set_parameters_atomically(changes)
        return result

    def _refusal(self, change: Parameter) -> str:
        """Say why a parameter may not be set: it is not there, or fixed at start."""
        if not self.has_parameter(change.name):
            return _no_such(self, change, self.list_parameters([], 0).names)
        if not self.describe_parameter(change.name).read_only:
            return ""
        allowed = self.describe_parameter(change.name).additional_constraints.removesuffix(f"; {FIXED}")
        remedy = "restart the node to change it" + (f", with {allowed}" if allowed else "")
        return f"{change.name} = {change.value}: {FIXED}; {remedy}"

    def _typed(self, change: Parameter) -> Parameter:
        """As a float where that is one: `ros2 param` reads 1e-06, its own way to write it, as a text."""
        if not self.has_parameter(change.name) or type(self.get_parameter(change.name).value) is not float:
            return change
        try:
            return Parameter(change.name, value=float(change.value)) if type(change.value) in (int, str) else change
        except ValueError:
            return change

    def _has(self, change: Parameter) -> bool:
        if not self.has_parameter(change.name):
            return False
        present = self.get_parameter(change.name)
        return bool((present.type_, present.value) == (change.type_, change.value))


def descriptor(setting: Setting) -> ParameterDescriptor:
    """Describe a setting to `ros2 param describe` and to graphical tools."""
    described = ParameterDescriptor(
        description=f"{setting.description} [{setting.unit}]" if setting.unit else setting.description,
        additional_constraints=f"{setting.allowed()}; {'may change at run time' if setting.changes else FIXED}",
        read_only=not setting.changes,
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


def declare(
    node: Node,
    settings: Sequence[Setting],
    preset: Preset | None = None,
    change: Change | None = None,
    *,
    quiet: bool = False,
) -> dict[str, Any]:
    """Declare every setting as a parameter of `node` and return the effective values as plain Python ones.

    `preset` changes defaults by what the node was given, a train's file for one. All values are checked before the
    first is accepted; a bad one raises ValueError with name, value and what is allowed. Afterwards those that may
    change do so through `change`; the others are read-only. What is not at its default is logged once, and
    unless `quiet` that all is. Construct the node with `automatically_declare_parameters_from_overrides=True`: then
    parameters that it was given but does not have are logged as well.
    """
    if node.has_parameter(_USE_SIM_TIME.name):
        _USE_SIM_TIME.check(node.get_parameter(_USE_SIM_TIME.name).value)
    defaults = {one.name: one.default for one in settings}
    given = {one.name: node.get_parameter(one.name).value for one in settings if node.has_parameter(one.name)}
    settings = settings if preset is None else preset(settings, given)
    values = {setting.name: _checked(setting, _given(node, setting)) for setting in settings}
    for name in values:  # an integer may have been given for a float
        node.set_descriptor(name, ParameterDescriptor(dynamic_typing=True))
    node.set_parameters([Parameter(name, value=value) for name, value in values.items()])
    for setting in settings:
        node.set_descriptor(setting.name, descriptor(setting))
    if change is not None:
        _let_change(node, settings, change)
    for message in unknown(node, settings) + ([] if quiet else misplaced(node)):
        node.get_logger().warning(message)
    told = [f"{name} = {value}" for name, value in values.items() if value != defaults[name]]
    if quiet and not told:
        return values
    node.get_logger().info(
        "parameters: " + ", ".join([*told, "all others at their defaults" if told else "all defaults"])
    )
    return values


def current(node: Node, settings: Sequence[Setting]) -> dict[str, Any]:
    """Return the values that the settings have now."""
    return {setting.name: node.get_parameter(setting.name).value for setting in settings}


def _let_change(node: Node, settings: Sequence[Setting], change: Change) -> None:
    """Check new values together, before any of them is set, and put them in force once all are."""
    by_name = {setting.name: setting for setting in settings}
    ready: list[Callable[[], None]] = []

    def check(changes: Sequence[Parameter]) -> SetParametersResult:
        try:
            new = {one.name: by_name[one.name].check(one.value) for one in changes if one.name in by_name}
            ready[:] = [change(current(node, settings) | new)] if new else []
        except (ValueError, OSError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def put_in_force(changes: Sequence[Parameter]) -> None:
        for done in ready:
            done()
            node.get_logger().info("changed: " + ", ".join(f"{one.name} = {one.value}" for one in changes))
        ready.clear()

    node.add_on_set_parameters_callback(check)
    node.add_post_set_parameters_callback(put_in_force)


def unknown(node: Node, settings: Sequence[Setting]) -> list[str]:
    """Return one message for each parameter that was given to `node` but that it does not have: a typo, as a rule.

    Only a warning: `-p` and the wildcard `/**` of a YAML file reach every node of a process.
    """
    names = [*_OF_RCLPY, *(setting.name for setting in settings)]
    return [
        _no_such(node, node.get_parameter(name), names)
        for name in node.list_parameters([], 0).names
        if not name.startswith(_OF_RCLPY_QOS) and name not in names
    ]


def misplaced(node: Node) -> list[str]:
    """Return one message for each quality of service that was given for a topic which the package does not have.

    It goes by the whole name, with its namespace and remapped: by another one it would be of no effect.
    """
    names = [node.resolve_topic_name(topic.name) for topic in TOPICS]
    given = ((name, _QOS.fullmatch(name)) for name in node.list_parameters([], 0).names)
    return [
        f"{name}: {node.get_name()} has no such topic{hint(topic[1], names)}"
        for name, topic in given
        if topic and topic[1] not in names
    ]


def _given(node: Node, setting: Setting) -> object:
    if node.has_parameter(setting.name):  # declared from what the node was given
        return node.get_parameter(setting.name).value
    return node.declare_parameter(setting.name, setting.default, ParameterDescriptor(dynamic_typing=True)).value


def _checked(setting: Setting, given: Any) -> Any:
    """Check it; of a text that YAML has taken for a number say how to give it: a shell takes its quotes away."""
    try:
        return setting.check(given)
    except ValueError as error:
        if type(setting.default) is not str or setting.choices or isinstance(given, str):
            raise
        raise ValueError(f"{error}: in quotes that reach ROS, -p {setting.name}:=\"'{given}'\"") from None


def _no_such(node: Node, given: Parameter, names: Sequence[str]) -> str:
    return f"{given.name} = {given.value!r}: {node.get_name()} has no such parameter{hint(given.name, names)}"


def hint(name: str, names: Sequence[str]) -> str:
    """Ask whether the nearest of the names is meant, if one is near."""
    close = get_close_matches(name, names, n=1)
    return f"; did you mean {close[0]}?" if close else ""

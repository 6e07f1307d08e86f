# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Parameters while a node runs: what changes, what stays as it is, and the time it goes by."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from conftest import SpinUntil
from probe import DEFAULTS, SPECS, Make, follows_clock, make
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from adhesion_node.core.setting import Setting
from adhesion_node.nodes.ros import qos
from adhesion_node.nodes.ros.params import declare
from adhesion_node.wire.topics import CLOCK

__all__ = ["make"]


@pytest.mark.parametrize(
    "changes",
    [{"start_mu": 0.1}, {"law": "dry"}, {"particles": 20.5}, {"use_sim_time": True, "law": "dry"}],
)
def test_nothing_changes_while_running(make: Make, changes: dict[str, Any]) -> None:
    node = make()
    declare(node, SPECS)
    parameters = [Parameter(name, value=value) for name, value in changes.items()]
    result = node.set_parameters_atomically(parameters)
    assert not result.successful
    (name, value), *_ = [change for change in changes.items() if change[0] != "use_sim_time"]
    (spec,) = [spec for spec in SPECS if spec.name == name]
    assert result.reason == (f"{name} = {value}: fixed at start; restart the node to change it, with {spec.allowed()}")
    assert {spec.name: node.get_parameter(spec.name).value for spec in SPECS} == DEFAULTS
    assert node.get_parameter("use_sim_time").value is False


def test_what_is_so_already_is_accepted(make: Make) -> None:
    """An own dump, loaded again; an integer for a float; beside it what changes."""
    node = make({"use_sim_time": True})
    declare(node, SPECS)
    for name, value in (DEFAULTS | {"length_m": 200, "use_sim_time": True}).items():
        assert node.set_parameters_atomically([Parameter(name, value=value)]).successful
    assert type(node.get_parameter("length_m").value) is float
    refused = node.set_parameters_atomically([Parameter("law", value="wet"), Parameter("particles", value=21)])
    assert (
        refused.reason
        == "particles = 21: fixed at start; restart the node to change it, with a finite value of at least 2"
    )


CHANGING = (
    *SPECS,
    Setting("wait_s", 2.0, "how long", "s", 1.0, 9.0, changes=True),
    Setting("name", "", "whose", changes=True),
)


def test_what_may_change_does_so_together_and_only_as_a_whole(make: Make) -> None:
    node, seen = make(), []

    def change(values: Mapping[str, Any]) -> Callable[[], None]:
        if values["wait_s"] > 5.0 and not values["name"]:
            raise ValueError(f"wait_s = {values['wait_s']}: give a name, too")
        return lambda: seen.append((values["wait_s"], values["name"], values["law"]))

    declare(node, CHANGING, change=change)

    def set_(**values: Any) -> SetParametersResult:
        return node.set_parameters_atomically([Parameter(name, value=value) for name, value in values.items()])

    assert set_(wait_s=3).successful
    assert set_(wait_s=6.0, name="a").successful
    assert seen == [(3.0, "", "wet"), (6.0, "a", "wet")]
    for bad, reason in (
        ({"name": "", "wait_s": 7}, "wait_s = 7.0: give a name, too"),
        ({"name": "b", "wait_s": "long"}, "wait_s = 'long': give a value of type float"),
        ({"name": "b", "law": "dry"}, "law = dry: fixed at start"),
        ({"name": 5}, "name = 5: give a value of type str"),
    ):
        result = set_(**bad)
        assert not result.successful
        assert reason in result.reason
    out_of_range = set_(name="b", wait_s=9.5)
    assert not out_of_range.successful
    assert "wait_s" in out_of_range.reason
    gone = node.set_parameters_atomically([Parameter("wait_s", Parameter.Type.NOT_SET)])
    assert not gone.successful
    assert (node.get_parameter("wait_s").value, node.get_parameter("name").value) == (6.0, "a")
    assert len(seen) == 2


def test_a_parameter_cannot_be_removed(make: Make) -> None:
    node = make()
    declare(node, SPECS)
    result = node.set_parameters_atomically([Parameter("start_mu", Parameter.Type.NOT_SET)])
    assert "fixed at start" in result.reason
    assert node.get_parameter("start_mu").value == 0.09


@pytest.mark.parametrize("kind", [SetParameters, SetParametersAtomically])
def test_a_type_that_is_none_is_refused_and_the_node_lives(
    make: Make, executor: SingleThreadedExecutor, spin_until: SpinUntil, kind: Any
) -> None:
    node = make()
    declare(node, SPECS, change=lambda _: lambda: None)
    executor.add_node(node)
    name = {SetParameters: "set_parameters", SetParametersAtomically: "set_parameters_atomically"}[kind]
    client = node.create_client(kind, f"probe/{name}")
    spin_until(executor, client.service_is_ready)
    for number, said in ((42, "law: type = 42: no parameter has it"), (4, "")):
        value = ParameterValue(type=number, string_value="wet")
        future = client.call_async(kind.Request(parameters=[ParameterMessage(name="law", value=value)]))
        spin_until(executor, future.done)
        response = future.result()
        results = response.results if kind is SetParameters else [response.result]
        assert [(one.successful, one.reason) for one in results] == [(not said, said)]


def test_sim_time_still_works(make: Make) -> None:
    assert not follows_clock(make())
    node = make({"use_sim_time": True})
    declare(node, SPECS)
    assert follows_clock(node)


@pytest.mark.parametrize("from_the_start", [True, False])
def test_a_clock_below_zero_is_not_used_and_the_node_lives(
    make: Make,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    from_the_start: bool,
    capfd: pytest.CaptureFixture[str],
) -> None:
    node = make({"use_sim_time": from_the_start})
    declare(node, SPECS)
    assert node.set_parameters_atomically([Parameter("use_sim_time", value=True)]).successful
    clock = qos.advertise(node, CLOCK)
    executor.add_node(node)
    spin_until(executor, clock.get_subscription_count)
    clock.publish(Clock(clock=Time(sec=-3)))
    spin_until(executor, lambda: "/clock = -3 s: not used; a time is 0 or more" in capfd.readouterr().err)
    clock.publish(Clock(clock=Time(sec=7)))
    spin_until(executor, lambda: node.get_clock().now().nanoseconds == 7 * 10**9)


def test_sim_time_of_a_wrong_type_is_refused(make: Make) -> None:
    with pytest.raises(ValueError, match=r"use_sim_time = 1: give .*true or false"):
        declare(make({"use_sim_time": 1}), SPECS)


def test_sim_time_can_be_switched_while_running(make: Make) -> None:
    node = make()
    declare(node, SPECS)
    (result,) = node.set_parameters([Parameter("use_sim_time", value=True)])
    assert result.successful
    assert follows_clock(node)

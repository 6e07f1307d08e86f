# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Parameters: types, ranges, messages, atomic refusal, and what tools see."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Protocol

import pytest
from builtin_interfaces.msg import Time
from conftest import SpinUntil
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.clock import ROSClock
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from adhesion_node.core.setting import Setting
from adhesion_node.nodes.ros import qos
from adhesion_node.nodes.ros.params import SettingsNode, declare, misplaced, unknown
from adhesion_node.wire.topics import CLOCK

SPECS = (
    Setting("start_mu", 0.09, "first guess of the adhesion coefficient", low=0.0, high=0.5),
    Setting("particles", 20, "number of particles", low=2),
    Setting("law", "wet", "speed law", choices=("dry", "wet")),
    Setting("verbose", False, "say more"),
    Setting("output", "bag", "where to"),
    Setting("length_m", 200.0, "length of the train", "m"),
)
DEFAULTS = {"start_mu": 0.09, "particles": 20, "law": "wet", "verbose": False, "output": "bag", "length_m": 200.0}


class Make(Protocol):
    """Type of the fixture `make`."""

    def __call__(self, overrides: dict[str, Any] | None = None, *, automatic: bool = True) -> SettingsNode: ...


@pytest.fixture
def make(context: Context) -> Iterator[Make]:
    """Make nodes with given parameters; they are destroyed after the test."""
    made: list[SettingsNode] = []

    def _make(overrides: dict[str, Any] | None = None, *, automatic: bool = True) -> SettingsNode:
        node = SettingsNode(
            "probe",
            context=context,
            parameter_overrides=[Parameter(name, value=value) for name, value in (overrides or {}).items()],
            automatically_declare_parameters_from_overrides=automatic,
        )
        made.append(node)
        return node

    yield _make
    for node in made:
        node.destroy_node()


def follows_clock(node: Node) -> bool:
    clock = node.get_clock()
    assert isinstance(clock, ROSClock)
    return clock.ros_time_is_active


@pytest.fixture(params=[True, False], ids=["automatic", "declared"])
def automatic(request: pytest.FixtureRequest) -> bool:
    return bool(request.param)


def typed(values: Iterable[object]) -> list[tuple[type, object]]:
    return [(type(value), value) for value in values]


def test_defaults_are_plain_values(make: Make, automatic: bool) -> None:
    values = declare(make(automatic=automatic), SPECS)
    assert values == DEFAULTS
    assert typed(values.values()) == typed(DEFAULTS.values())


def test_given_values_win_and_an_integer_serves_for_a_float(make: Make, automatic: bool) -> None:
    node = make({"start_mu": 0, "law": "dry", "particles": 7, "verbose": True}, automatic=automatic)
    values = declare(node, SPECS)
    assert values == DEFAULTS | {"start_mu": 0.0, "law": "dry", "particles": 7, "verbose": True}
    assert type(values["start_mu"]) is float
    assert node.get_parameter("start_mu").type_ is Parameter.Type.DOUBLE


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("start_mu", 0.6, r"start_mu = 0\.6: give a value from 0 to 0\.5"),
        ("start_mu", -1, r"start_mu = -1: give a value from 0 to 0\.5"),
        ("start_mu", float("nan"), r"start_mu = nan: give a value from 0 to 0\.5"),
        ("start_mu", "wet", r"start_mu = 'wet': give a value of type float \(a value from 0 to 0\.5\)"),
        ("start_mu", True, r"start_mu = True: give a value of type float"),
        ("start_mu", [0.1], r"start_mu = .*0\.1.*: give a value of type float"),
        ("length_m", float("inf"), r"length_m = inf: give a finite value m"),
        ("particles", 1, r"particles = 1: give a finite value of at least 2"),
        ("particles", 20.0, r"particles = 20\.0: give a value of type int"),
        ("particles", False, r"particles = False: give a value of type int"),
        ("law", "muddy", r"law = 'muddy': choose one of dry, wet"),
        ("law", 1, r"law = 1: give a value of type str \(one of dry, wet\)"),
        ("verbose", 1, r"verbose = 1: give a value of type bool \(true or false\)"),
        ("output", 5, r"output = 5: give a value of type str \(a text\)"),
    ],
)
def test_a_bad_value_is_refused_with_name_value_and_what_is_allowed(
    make: Make, automatic: bool, name: str, value: object, message: str
) -> None:
    node = make({name: value}, automatic=automatic)
    with pytest.raises(ValueError, match=message) as refusal:
        declare(node, SPECS)
    assert "\n" not in str(refusal.value)


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


def test_tools_see_unit_range_and_choices(make: Make) -> None:
    node = make()
    declare(node, SPECS)
    (range_,) = node.describe_parameter("start_mu").floating_point_range
    assert (range_.from_value, range_.to_value) == (0.0, 0.5)
    (least,) = node.describe_parameter("particles").integer_range
    assert (least.from_value, least.to_value) == (2, 2**63 - 1)
    assert node.describe_parameter("length_m").description == "length of the train [m]"
    assert node.describe_parameter("law").additional_constraints == "one of dry, wet; fixed at start"
    assert node.describe_parameter("law").read_only
    changing = make()
    declare(changing, CHANGING)
    assert not changing.describe_parameter("wait_s").read_only
    assert "may change at run time" in changing.describe_parameter("wait_s").additional_constraints


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


def test_a_typo_is_named_with_the_nearest_parameter(make: Make) -> None:
    given = {"start_nu": 0.1, "zzz": 1, "use_sim_time": True, "qos_overrides./position.subscription.depth": 5}
    node = make(given)
    declare(node, SPECS)
    assert sorted(unknown(node, SPECS)) == [
        "start_nu = 0.1: probe has no such parameter; did you mean start_mu?",
        "zzz = 1: probe has no such parameter",
    ]


@pytest.mark.parametrize(
    ("topic", "told"),
    [
        ("/train1/position", []),
        ("/train1/gnss", []),
        ("/clock", []),
        ("/position", ["/position: probe has no such topic; did you mean /train1/position?"]),
        (
            "/train1/brake_presure",
            ["/train1/brake_presure: probe has no such topic; did you mean /train1/brake_pressure?"],
        ),
    ],
)
def test_a_quality_of_service_for_no_topic_is_told(context: Context, topic: str, told: list[str]) -> None:
    """By its whole name, after namespace and remapping."""
    name = f"qos_overrides.{topic}.subscription.deadline"
    node = SettingsNode(
        "probe",
        context=context,
        namespace="train1",
        cli_args=["--ros-args", "-r", "odometry:=gnss"],
        automatically_declare_parameters_from_overrides=True,
        parameter_overrides=[Parameter(name, value=1)],
    )
    assert misplaced(node) == [one.replace(topic, name, 1) for one in told]
    node.destroy_node()


def test_the_effective_configuration_is_logged_once(make: Make, capfd: pytest.CaptureFixture[str]) -> None:
    declare(make({"start_mu": 0, "start_nu": 1}), SPECS)
    logged = capfd.readouterr().err
    assert logged.count("start_mu = 0.0, all others") == 1
    assert logged.count("did you mean start_mu?") == 1

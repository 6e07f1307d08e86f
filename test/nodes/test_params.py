# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Parameters: types, ranges, messages, atomic refusal, and what tools see."""

from __future__ import annotations

import pytest
from probe import DEFAULTS, SPECS, Make, automatic, make, typed
from rclpy.context import Context
from rclpy.parameter import Parameter
from test_params_at_run_time import CHANGING

from adhesion_node.nodes.ros.params import SettingsNode, declare, misplaced, unknown

__all__ = ["automatic", "make"]


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
        ("output", 5, r"output = 5: give a value of type str \(a text\): in quotes that reach ROS, -p output:=\"'5'\""),
    ],
)
def test_a_bad_value_is_refused_with_name_value_and_what_is_allowed(
    make: Make, automatic: bool, name: str, value: object, message: str
) -> None:
    node = make({name: value}, automatic=automatic)
    with pytest.raises(ValueError, match=message) as refusal:
        declare(node, SPECS)
    assert "\n" not in str(refusal.value)


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


def test_a_typo_is_named_with_the_nearest_parameter(make: Make) -> None:
    typos = {"start_nu": 0.1, "zzz": 1, "use_simtime": True}
    given = {**typos, "use_sim_time": True, "qos_overrides./position.subscription.depth": 5}
    node = make(given)
    declare(node, SPECS)
    assert sorted(unknown(node, SPECS)) == [
        "start_nu = 0.1: probe has no such parameter; did you mean start_mu?",
        "use_simtime = True: probe has no such parameter; did you mean use_sim_time?",
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

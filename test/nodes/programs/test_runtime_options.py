# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Options, parameters and parameter files of a node as a real program: what is refused, and with what words."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import PATIENCE_S
from runnable import Start, end, start

from adhesion_node.command.options import BAD_INPUT
from adhesion_node.nodes.ros import runtime
from adhesion_node.wire.files.parameters import sections, unheeded

__all__ = ["start"]


def test_an_integer_for_a_float_is_accepted(start: Start) -> None:
    program = start("--ros-args", "-p", "gain:=0", TASK="finish")
    assert end(program) == (0, [])


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("-p", "gain:=7"), "gain = 7: give a value from 0 to 1 dB"),
        (("-p", "gain:=loud"), "gain = 'loud': give a value of type float (a value from 0 to 1 dB)"),
        (("-p", "use_sim_time:=1"), "use_sim_time = 1: give a value of type bool (true or false)"),
        (("--params-file", "/nowhere.yaml"), "/nowhere.yaml"),
        (("-p", "gain"), "gain"),
        (("-r", "__node:=a b"), "a b"),
        (("--gain", "1"), "ROS arguments ['--gain', '1']: ROS has none such; a parameter is given as -p NAME:=VALUE"),
    ],
)
def test_bad_ros_arguments_are_one_line_and_code_2(start: Start, args: tuple[str, ...], message: str) -> None:
    code, errors = end(start("--ros-args", *args))
    assert code == BAD_INPUT
    (complaint,) = [line for line in errors if not line.startswith("[ERROR]")]  # rcl logs some of them itself
    assert complaint.startswith("probe: ")
    assert message in complaint


@pytest.mark.parametrize(
    ("section", "told"), [("prob", True), ("probe", False), ("/**", False), ("/other/probe", True)]
)
def test_a_parameter_file_for_another_node_is_told(start: Start, tmp_path: Path, section: str, told: bool) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(f"{section}:\n  ros__parameters:\n    gain: 0.25\n")
    program = start("--ros-args", "--params-file", str(file), TASK="finish")
    _, errors = program.communicate(timeout=PATIENCE_S)
    assert program.returncode == 0
    assert (f"has sections for {section.strip('/')}, none for /probe: name one 'probe' or '/**'" in errors) == told
    assert ("gain = 0.25" in errors) != told


@pytest.mark.parametrize("text", ["", "# /**:\n#   ros__parameters:\n#     gain: 0.25\n", "time,position\n0,1\n"])
def test_a_parameter_file_without_parameters_is_told(start: Start, tmp_path: Path, text: str) -> None:
    """ROS takes it without a word; a node that was ready ended in a traceback."""
    file = tmp_path / "parameters.yaml"
    file.write_text(text)
    program = start("--ros-args", "--params-file", str(file), TASK="finish")
    _, errors = program.communicate(timeout=PATIENCE_S)
    assert program.returncode == 0
    assert f"params = {file}: not a readable ROS parameter file: it is to hold, one in the other, NODE" in errors


@pytest.mark.parametrize(
    ("rules", "told"),
    [
        (("positon:=/gnss",), "-r positon:=/gnss: probe has no topic /positon; did you mean /position?"),
        (
            ("__ns:=/train1", "/position:=/gnss"),
            "-r /position:=/gnss: probe has no topic /position; did you mean /train1/position?",
        ),
        (("probe:zzz:=/gnss",), "-r probe:zzz:=/gnss: probe has no topic /zzz"),
        (("__ns:=/train1", "position:=/gnss", "/train1/imu:=/imu/data"), ""),
        (("rosservice://~/reset:=/again", "probe/reset:=/again", "other:zzz:=/gnss", "/clock:=/time"), ""),
    ],
)
def test_a_topic_that_is_remapped_but_not_there_is_told(start: Start, rules: tuple[str, ...], told: str) -> None:
    """ROS takes it without a word, and a sensor that may be missing is missed for ever."""
    given = [word for rule in rules for word in ("-r", rule)]
    code, errors = end(start("--ros-args", *given, TASK="finish"))
    assert code == 0
    assert [line.partition("]: ")[2] for line in errors if "has no topic" in line] == ([told] if told else [])


@pytest.mark.parametrize("value", ["{}", "[]"])
def test_a_parameter_without_a_value_is_named(start: Start, tmp_path: Path, value: str) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(f"probe:\n  ros__parameters:\n    gain: {value}\n")
    told = f"probe: --params-file {file}: gain = {value}: give a value, or leave it out"
    assert end(start("--ros-args", "--params-file", str(file))) == (BAD_INPUT, [told])


def test_nested_namespaces_are_sections_too(tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text("train1:\n  probe: {ros__parameters: {gain: 1.0}}\n  other: {ros__parameters: {}}\n")
    assert [one.name for one in sections(str(file))] == ["train1/probe", "train1/other"]
    assert unheeded(["--params-file", str(file)], "/train1/probe") == []
    (warning,) = unheeded(["-p", "a:=1", "--params-file", str(file)], "/train2/probe")
    assert "has sections for train1/probe, train1/other, none for /train2/probe" in warning


def test_arguments_without_ros_args_are_refused(start: Start) -> None:
    code, complaints = end(start("-p", "gain:=0"))
    assert code == BAD_INPUT
    assert "unrecognized arguments: -p gain:=0" in complaints[-1]
    assert "--ros-args -p NAME:=VALUE" in complaints[0]


def test_help_shows_the_parameters(start: Start) -> None:
    program = start("--help")
    shown, errors = program.communicate(timeout=PATIENCE_S)
    assert (program.returncode, errors) == (0, "")
    assert "A node that says what it does." in shown
    assert "gain (default: 0.5): a gain; a value from 0 to 1 dB" in shown


def test_own_and_ros_arguments_are_told_apart() -> None:
    args = ["--output", "x", "--ros-args", "-p", "a:=1", "--", "--json", "-", "--ros-args", "-r", "a:=b"]
    own, ros = runtime.split_ros_arguments(args)
    assert own == ["--output", "x", "--json", "-"]
    assert ros == ["--ros-args", "-p", "a:=1", "--", "--ros-args", "-r", "a:=b"]

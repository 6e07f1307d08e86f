# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Parameter files of ROS, read offline: the sections, wildcards, namespaces and the precedence of rclpy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path

import pytest
from rclpy.context import Context
from rclpy.node import Node

from adhesion_node.wire.files.parameters import read, unheeded


def section(name: str, **values: float) -> str:
    lines = "".join(f"    {key}: {value}\n" for key, value in values.items())
    return f"{name}:\n  ros__parameters:\n{lines}"


NESTED = "train1:\n  estimator:\n    ros__parameters:\n      window: 40\n      train:\n        mass_kg: 4.0e5\n"
FILES = {
    "a fully qualified name": section("/train1/estimator", window=40),
    "one part of it": section("/*/estimator", window=40),
    "nested namespaces": NESTED,
    "everybody": section("/**", window=40, step=4),
    "every estimator": section("/**/estimator", window=40),
    "the later one wins": section("/**", window=30, step=4) + section("/train1/estimator", window=40),
    "also when it is for everybody": section("/train1/estimator", window=30, step=4) + section("/**", window=40),
    "others beside": section("simulator", seed=3) + section("/train1/estimator", window=40),
}


@pytest.mark.parametrize("text", FILES.values(), ids=FILES)
def test_what_ros_gives_the_node_the_replay_reads(text: str, tmp_path: Path, context: Context) -> None:
    """By the node's full name and, where the file speaks of one node alone, by its bare one."""
    file = tmp_path / "params.yaml"
    file.write_text(text)
    node = Node(
        "estimator",
        namespace="/train1",
        context=context,
        cli_args=["--ros-args", "--params-file", str(file)],
        use_global_arguments=False,
        automatically_declare_parameters_from_overrides=True,
    )
    names = set(node.list_parameters([], 0).names) - {"use_sim_time", "start_type_description_service"}
    expected = {name: node.get_parameter(name).value for name in names}
    node.destroy_node()
    assert expected["window"] == 40
    assert read(str(file), "/train1/estimator") == read(str(file), "estimator") == expected


TWO = section("/train1/estimator", window=40) + section("/train2/estimator", window=30)


def test_two_trains_with_other_values_are_refused_until_one_is_named(tmp_path: Path) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(TWO)
    with pytest.raises(
        ValueError, match=r"gives /train1/estimator and /train2/estimator other values: .*--node /train1/e"
    ):
        read(str(file), "estimator")
    assert read(str(file), "/train2/estimator") == {"window": 30}
    file.write_text(TWO.replace("30", "40"))
    assert read(str(file), "estimator") == {"window": 40}


@pytest.mark.parametrize("node", ["estimator", "/train3/estimator"])
def test_a_file_for_others_is_refused(node: str, tmp_path: Path) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(section("/train1/simulator", seed=1))
    with pytest.raises(ValueError, match=r"has train1/simulator: name the node 'estimator' or '/\*\*'"):
        read(str(file), node)


PASSED = ("-p use_sim_time:=true", "-p rate:=1e-6", "-p rate:=2")
MINE, ALL, OTHER = "/**/estimator", "/**", "/train1/estimator"
ORDERS = (
    [MINE, "-p window:=50"],
    ["-p use_sim_time:=true", MINE, "-p window:=50"],
    ["-p window:=50", MINE],
    [ALL, MINE, "-p window:=50"],
    [MINE, ALL],
    [ALL, MINE, ALL],
    ["-p window:=40", MINE, "-p window:=50"],
    ["-p use_sim_time:=true", MINE, "-p window:=40"],
    [ALL, "-p window:=50", OTHER, MINE],
    [OTHER, MINE, "-p window:=50"],
    ["-p rate:=1e-6", MINE, "-p window:=50", "-p rate:=2"],
)


@pytest.mark.parametrize("order", ORDERS, ids=" ".join)
def test_what_an_earlier_name_shadows_is_told(order: list[str], tmp_path: Path, context: Context) -> None:
    """Told is what ROS does not do as it was asked last, and the remedy helps."""
    given = []
    for number, one in enumerate(order):
        file = tmp_path / f"{number}.yaml"
        file.write_text("" if one.startswith("-p") else section(one, window=40 + number))
        given.append(one.split() if one.startswith("-p") else ["--params-file", str(file)])
    said = [one.partition("window:=")[2] or 40 + number for number, one in enumerate(order) if one not in PASSED]
    asked = int(said[-1])

    def window(arguments: Iterable[Sequence[str]]) -> int:
        node = Node(
            "estimator",
            namespace="/train1",
            context=context,
            cli_args=["--ros-args", *chain(*arguments)],
            use_global_arguments=False,
            automatically_declare_parameters_from_overrides=True,
        )
        value = int(node.get_parameter("window").value)
        node.destroy_node()
        return value

    told = unheeded([*chain(*given)], "/train1/estimator")
    assert bool(told) == (window(given) != asked)
    for warning in told:
        assert f"window = {asked} is shadowed, {window(given)} holds: give every --params-file before" in warning
    ranked = sorted(zip(order, given, strict=True), key=lambda pair: (pair[0].startswith("-p"), pair[0] == ALL))
    better = [arguments for _, arguments in ranked]
    assert not told or (window(better), unheeded([*chain(*better)], "/train1/estimator")) == (asked, [])

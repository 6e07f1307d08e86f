# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Parameter files of ROS, read offline: the sections, wildcards, namespaces and the precedence of rclpy."""

from __future__ import annotations

from pathlib import Path

import pytest
from rclpy.context import Context
from rclpy.node import Node

from adhesion_node.wire.parameter_file import read


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

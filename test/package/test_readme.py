# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The README says what the code does: parameters, topics, distances."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from test_defaults import NODES

from adhesion_node.bag import BagReader, select
from adhesion_node.live.node import Live
from adhesion_node.nodes import estimator
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.nodes.ros import qos
from adhesion_node.nodes.ros.params import Spec
from adhesion_node.study.xie import distances
from adhesion_node.wire import topics

README = (ROOT / "README.md").read_text(encoding="utf-8")

OF_ROS = re.compile(r"use_sim_time|start_type_description_service|qos_overrides\..+")
"""Parameters that rclpy gives to every node."""


def section(heading: str) -> str:
    """Return the text below a heading up to the next one of the same rank or above."""
    after = README.split(f"\n{heading}\n")[1]
    return re.split(rf"^#{{1,{heading.index(' ')}}} ", after, flags=re.MULTILINE)[0]


def parameter_row(spec: Spec) -> str:
    """Return the line of the parameter table that describes a parameter."""
    default = f"{spec.default:.6g}" if isinstance(spec.default, float) else str(spec.default).lower()
    if spec.choices:
        allowed = ", ".join(spec.choices)
    elif isinstance(spec.default, bool):
        allowed = "true, false"
    elif isinstance(spec.default, str):
        allowed = "text"
    else:
        allowed = f"{spec.minimum:g} to {spec.maximum:g}"
    return f"| `{spec.name}` | {default} | {spec.unit} | {allowed} | {spec.description} |"


HEADINGS = {
    "estimator": "### Parameters of the estimator",
    "atp_monitor": "### Parameters of the ATP monitor",
    "creep_estimator": "### Parameters of the creep estimator",
    "simulator": "### Parameters of the simulator",
    "slip_simulator": "### Parameters of the slip simulator",
}


@pytest.mark.parametrize("name", NODES)
def test_the_parameter_table_is_that_of_the_code(name: str) -> None:
    rows = re.findall(r"^\| `.+\|$", section(HEADINGS[name]), flags=re.MULTILINE)
    expected = [parameter_row(spec) for spec in NODES[name][1]]
    assert rows == expected, "the table must read:\n" + "\n".join(expected)


def all_nodes(context: Context, folder: Path, reader: BagReader) -> Iterator[tuple[str, Callable[[], Node]]]:
    """Yield every node by its program, set up so that it opens all the topics it ever does."""
    noisy = [Parameter(name, value=0.1) for name in ("speed_std_mps", "wheel_speed_std_radps")]
    for name, (make, _) in NODES.items():
        given = noisy if name == "simulator" else []
        yield name, partial(make, context=context, parameter_overrides=given)
    simulated = [Parameter("use_sim_time", value=True)]
    yield "recorder", lambda: Recorder(folder / "bag", context=context, parameter_overrides=simulated)
    yield "replay", lambda: Replay(reader, select(reader.topics), context=context)
    yield "live", lambda: Live("127.0.0.1", 0, context=context)


def topic_rows() -> dict[tuple[str, str], str]:
    """Return the quality of service by name and type of the table of topics."""
    table: dict[tuple[str, str], str] = {}
    for row in re.findall(r"^\| `.+\|$", section("## Topics"), flags=re.MULTILINE):
        names, types, service, _ = row.strip("| ").split(" | ")
        every, kinds = re.findall(r"`([^`]+)`", names), types.split(", ")
        of_each = kinds * len(every) if len(kinds) == 1 else kinds
        table |= dict.fromkeys(zip(every, of_each, strict=True), service)
    return table


def short_type(message: Any) -> str:
    return f"{message.__module__.partition('.')[0]}/{message.__name__}"


def test_topics_and_parameters_of_every_node_are_documented(context: Context, tmp_path: Path) -> None:
    opened: set[tuple[str, str]] = set()
    with BagReader(ROOT / "bags" / "tunnel_entry") as reader:
        for program, make in all_nodes(context, tmp_path, reader):
            node = make()
            ends: list[Publisher | Subscription] = [*node.publishers, *node.subscriptions]
            parameters = {name for name in node.list_parameters([], 0).names if not OF_ROS.fullmatch(name)}
            opened |= {(end.topic_name, short_type(end.msg_type)) for end in ends}
            if isinstance(node, Live | Recorder):
                node.close()
            node.destroy_node()
            documented = NODES[program][1] if program in NODES else ()
            assert parameters == {spec.name for spec in documented}, program
    of_rclpy = {("/rosout", "rcl_interfaces/Log"), ("/parameter_events", "rcl_interfaces/ParameterEvent")}
    assert {(f"/{name.lstrip('/')}", kind) for name, kind in topic_rows()} == opened - of_rclpy


@pytest.mark.parametrize("topic", estimator.OUTPUTS)
def test_the_readme_names_the_quality_of_service(topic: topics.Topic) -> None:
    expected = "latched" if estimator.OUTPUTS[topic] is qos.EXPIRING else "result"
    assert topic_rows()[topic.name, topic.type.replace("/msg/", "/")] == expected


@pytest.mark.parametrize("row", distances.rows(), ids=lambda row: f"{row['from_kmh']}-{row['case']}")
def test_the_distances_are_those_of_the_study(row: dict[str, float]) -> None:
    line = (
        f"| {row['from_kmh']} → {row['to_kmh']} | {row['case']} | {row['distance_m']:.1f} | "
        f"{row['paper_distance_m']:.1f} | {row['time_s']:.1f} | {row['paper_time_s']:.1f} |"
    )
    assert line in README

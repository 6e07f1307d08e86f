# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The file of defaults: every parameter of every node with its default, read by ROS and by the offline replay alike."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from conftest import ROOT
from rclpy.context import Context
from rclpy.node import Node
from test_offline import samples, write_run

from adhesion_node.core import Config
from adhesion_node.core.setting import Setting, Value
from adhesion_node.nodes import atp_monitor, creep_estimator, estimator, replay
from adhesion_node.tools import defaults
from adhesion_node.wire.settings.telling import TELLING
from sim_node.nodes import simulator
from sim_node.nodes import slip_simulator as slip_node

DEFAULTS = ROOT / "adhesion_node" / "nodes" / "defaults.yaml"

NODES: dict[str, tuple[Callable[..., Node], tuple[Setting, ...]]] = {
    "simulator": (simulator.Simulator, simulator.PARAMETERS),
    "estimator": (estimator.Estimator, estimator.PARAMETERS),
    "atp_monitor": (atp_monitor.AtpMonitor, atp_monitor.PARAMETERS),
    "creep_estimator": (creep_estimator.CreepEstimator, creep_estimator.PARAMETERS),
    "slip_simulator": (slip_node.SlipSimulator, slip_node.PARAMETERS),
}


def sections(path: Path = DEFAULTS) -> dict[str, dict[str, Any]]:
    """Return the parameters of each node as ROS spells them: `train: {mass_kg: 1}` is train.mass_kg."""
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert all(name[:4] == "/**/" for name in document), "in every namespace"
    assert all(list(section) == ["ros__parameters"] for section in document.values())
    return {name[4:]: dict(spelled(section["ros__parameters"])) for name, section in document.items()}


def spelled(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from spelled(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def typed(values: Mapping[str, Value]) -> dict[str, tuple[type, Value]]:
    return {name: (type(value), value) for name, value in values.items()}


def other(value: Value) -> Value:
    """Return a value that every range of the estimator allows where it allows the given one."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1 if value == 1 else value - 1
    if isinstance(value, float):
        return value * 0.999 if value else 1e-3
    others = {
        "axle": "radar",
        "cylinder": "mean",
        "snow": "wet",
        "wet": "snow",
        "bank": "particle_em",
        "track": "map",
        "train": "train1",
        "up": "down",
        "auto": "position",
        "": "tunnel 0 1000",
    }
    return others[value]


def test_the_file_is_what_the_declarations_say() -> None:
    assert DEFAULTS.read_text(encoding="utf-8") == defaults.text(), "run python -m adhesion_node.tools.defaults"


def test_there_is_a_section_for_each_node_with_parameters() -> None:
    told = typed({spec.name: spec.default for spec in TELLING})
    others = {name: typed(values) for name, values in sections().items() if name not in NODES}
    assert set(NODES) < set(sections())
    assert others == dict.fromkeys(("recorder", "replay", "live"), told)


@pytest.mark.parametrize("name", NODES)
def test_a_section_lists_the_nodes_parameters_with_their_defaults(name: str) -> None:
    assert typed(sections()[name]) == typed({spec.name: spec.default for spec in NODES[name][1]})


def start(name: str, path: Path, context: Context) -> Node:
    """Start a node as a program would, with a parameter file."""
    arguments = ["--ros-args", "--params-file", str(path)]
    return NODES[name][0](context=context, cli_args=arguments, use_global_arguments=False)


@pytest.mark.parametrize("name", NODES)
def test_a_node_starts_from_the_file_without_a_complaint(
    name: str, context: Context, capfd: pytest.CaptureFixture[str]
) -> None:
    node = start(name, DEFAULTS, context)
    effective = {spec.name: node.get_parameter(spec.name).value for spec in NODES[name][1]}
    node.destroy_node()
    assert typed(effective) == typed(sections()[name])
    assert "WARN" not in capfd.readouterr().err


def test_with_the_defaults_the_estimator_is_the_nominal_one(context: Context) -> None:
    node = start("estimator", DEFAULTS, context)
    assert isinstance(node, estimator.Estimator)
    assert node.config == Config()
    node.destroy_node()


def write_changed(path: Path) -> dict[str, Any]:
    """Write the file with every value of the estimator changed, and return the values."""
    document = yaml.safe_load(DEFAULTS.read_text(encoding="utf-8"))
    section = document["/**/estimator"]["ros__parameters"]
    path.with_suffix(".csv").write_text("lat,lon\n47,8\n47.1,8\n", encoding="utf-8")
    document["/**/estimator"]["ros__parameters"] = {
        **_changed(section),
        **{
            "track_line": str(path.with_suffix(".csv")),
            "train_file": "metro",
            "rail_map": "",  # the changed method begins without one
        },
    }
    with path.open("w", encoding="utf-8") as stream:
        yaml.safe_dump(document, stream)
    return sections(path)["estimator"]


def _changed(section: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _changed(value) if isinstance(value, Mapping) else other(value) for name, value in section.items()}


def test_the_estimator_really_reads_the_file(tmp_path: Path, context: Context) -> None:
    changed = write_changed(tmp_path / "changed.yaml")
    assert set(changed.items()) & set(sections()["estimator"].items()) == {("rail_map", "")}
    node = start("estimator", tmp_path / "changed.yaml", context)
    assert isinstance(node, estimator.Estimator)
    assert not node.configured, "autostart is changed, too"
    node.trigger_configure()
    assert {name: node.get_parameter(name).value for name in changed} == pytest.approx(changed)
    config = node.config
    assert (config.window, config.low_adhesion, config.train.pads) == (49, "wet", 95)
    assert config.train.mass_kg == pytest.approx(0.999 * 536e3)
    assert len(config.track.sections) == 1
    node.destroy_node()


def digest_offline(bag: Path, result: Path, *options: str) -> str:
    assert replay.main([str(bag), "--offline", "--json", str(result), *options]) in (0, 1)  # little identifies nothing
    return str(json.loads(result.read_text())["digest"])


def test_the_offline_replay_reads_the_file(tmp_path: Path) -> None:
    write_run(tmp_path / "bag", samples(16.0, 24.0))
    quick, result = ["--set", "iterations=3"], tmp_path / "result.json"
    nominal = digest_offline(tmp_path / "bag", result, *quick)
    assert digest_offline(tmp_path / "bag", result, "--params", str(DEFAULTS), *quick) == nominal
    write_changed(tmp_path / "changed.yaml")
    # in the changed frame there is no message, and every sensor is switched off
    accepted = ["--set", "frame=track", "--set", "use_position=true", "--set", "use_brake_pressure=true"]
    changed = digest_offline(tmp_path / "bag", result, "--params", str(tmp_path / "changed.yaml"), *quick, *accepted)
    assert changed != nominal


def test_a_file_for_all_nodes_may_set_nothing_of_the_estimators(tmp_path: Path, context: Context) -> None:
    """What ROS accepts here, test_offline.py demands of the offline replay."""
    (tmp_path / "params.yaml").write_text("/**:\n  ros__parameters:\n    use_sim_time: true\n")
    node = start("estimator", tmp_path / "params.yaml", context)
    assert isinstance(node, estimator.Estimator)
    assert node.config == Config()
    node.destroy_node()


def test_help_lists_every_parameter_with_its_default() -> None:
    code = "import sys; from adhesion_node.nodes.estimator import main; sys.exit(main(['--help']))"
    shown = subprocess.run(
        [sys.executable, "-c", code], env=os.environ, capture_output=True, text=True, check=True, timeout=60.0
    ).stdout
    for name, value in sections()["estimator"].items():
        assert f"  {name} (default: {value}): " in shown


@pytest.mark.parametrize("name", NODES)
def test_every_parameter_has_a_description_and_every_number_a_range(name: str) -> None:
    for spec in NODES[name][1]:
        assert spec.description, spec.name
        if isinstance(spec.default, (int, float)) and not isinstance(spec.default, bool):
            assert math.isfinite(spec.low), spec.name
            assert math.isfinite(spec.high), spec.name

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The pages say what the code does: what is generated is what is committed, links lead somewhere, examples run."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
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
from test_package import console_scripts

from adhesion_node.bag import BagReader, select
from adhesion_node.core.bank import layout
from adhesion_node.live.node import Live
from adhesion_node.nodes import atp_monitor, creep_estimator, estimator
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.report.__main__ import main as report
from adhesion_node.study.__main__ import main as study
from adhesion_node.tools.demo.staged import LEVEL
from sim_node.nodes import simulator, slip_simulator
from sim_node.real.plant.scenarios import SCENARIOS as REAL
from sim_node.real.sensors.fitted import FITTED
from sim_node.train.scenario import SCENARIOS

DOC = ROOT / "doc"
PAGES = [ROOT / "README.md", *sorted(DOC.glob("*.md"))]
LINKED = [*PAGES, ROOT / "bags" / "README.md", ROOT / "resource" / "QUALITY_DECLARATION.md"]
MADE_BY: dict[str, dict[str, str]] = json.loads((DOC / "evidence" / "made_by.json").read_text(encoding="utf-8"))

OF_ROS = re.compile(r"use_sim_time|start_type_description_service|qos_overrides\..+")
"""Parameters that rclpy gives to every node."""

NODES: dict[str, Callable[..., Node]] = {
    "simulator": simulator.Simulator,
    "estimator": estimator.Estimator,
    "atp_monitor": atp_monitor.AtpMonitor,
    "creep_estimator": creep_estimator.CreepEstimator,
    "slip_simulator": slip_simulator.SlipSimulator,
}
HEADINGS = {
    "estimator": "Estimator",
    "atp_monitor": "ATP monitor",
    "creep_estimator": "Creep estimator",
    "simulator": "Simulator",
    "slip_simulator": "Slip simulator",
    "recorder": "Recorder",
    "replay": "Replay",
    "live": "Live page",
}


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def check(folder: Path) -> subprocess.CompletedProcess[str]:
    """Compare the pages of a folder with what its generator writes."""
    return subprocess.run(
        [sys.executable, str(folder / "generate.py"), "--check"],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_what_is_generated_is_what_is_committed() -> None:
    checked = check(DOC)
    assert checked.returncode == 0, f"{checked.stdout}{checked.stderr}run python doc/generate.py"


@pytest.mark.parametrize(
    ("name", "written"),
    [("README.md", "| bank, the default | 0."), ("doc/parameters.md", "| `train.mass_kg` | 5")],
)
def test_a_page_with_another_number_is_found(tmp_path: Path, name: str, written: str) -> None:
    shutil.copytree(DOC, tmp_path / "doc")
    shutil.copy(ROOT / "README.md", tmp_path)
    page = tmp_path / name
    changed = text_of(page).replace(written, f"{written}9")
    assert changed != text_of(page)
    page.write_text(changed, encoding="utf-8")
    checked = check(tmp_path / "doc")
    assert (checked.returncode, checked.stdout.split(":")[0]) == (1, page.name)


def test_the_tests_that_pages_name_are_there() -> None:
    named = {name for page in PAGES for name in re.findall(r"`(test(?:_[a-z0-9]+){3,})`", text_of(page))}
    written = {name for file in (ROOT / "test").rglob("*.py") for name in re.findall(r"def (test_\w+)", text_of(file))}
    assert len(named) > 20
    assert named <= written


def test_the_readme_is_short() -> None:
    assert len(text_of(ROOT / "README.md").splitlines()) <= 250


def test_the_table_of_the_readme_is_that_of_the_reference_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The demo's run, scenario and seed, is the recording's; it is told that the line is level."""
    (shown,) = re.findall(r"^```text\n(.*?)^```$", text_of(ROOT / "README.md"), re.MULTILINE | re.DOTALL)
    options = ("--output", str(tmp_path / "report"), "--target", "100", "--set", f"track={LEVEL}")
    assert report([str(ROOT / "bags" / "tunnel_entry"), *options]) == 0
    assert shown in capsys.readouterr().out


def anchors(page: Path) -> set[str]:
    """Return what a link may name after #: the headings as GitHub and Sphinx spell them."""
    headings = re.findall(r"^#{1,6} (.+)$", text_of(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", LINKED, ids=lambda page: page.name)
def test_every_link_leads_somewhere(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]*))?\)", text_of(page))
    for path, anchor in links:
        target = (page.parent / path).resolve() if path else page
        assert target.is_relative_to(ROOT), path
        assert target.exists(), path
        assert not anchor or anchor in anchors(target), f"{path}#{anchor}"


def test_the_contents_name_every_page_and_picture() -> None:
    listed = set(re.findall(r"\]\((\w+\.md)\)", text_of(DOC / "index.md")))
    assert listed == {page.name for page in DOC.glob("*.md")} - {"index.md"}
    shown = {name for page in PAGES for name in re.findall(r"pictures/(\w+\.png)\)", text_of(page))}
    assert shown == {picture.name for picture in (DOC / "pictures").iterdir()}


def test_every_program_and_every_scenario_is_named() -> None:
    named = set(re.findall(r"`(\w+)`", text_of(ROOT / "README.md")))
    assert console_scripts().keys() <= named
    assert {*SCENARIOS, *REAL, *FITTED} <= set(re.findall(r"^\| `(\w+)` \|", text_of(DOC / "demo.md"), re.MULTILINE))


def test_the_page_of_the_bank_names_every_component_of_its_state() -> None:
    listed = re.findall(r"^\| `([A-Z]+)` \|", section("bank.md", "What is believed"), re.MULTILINE)
    assert [vars(layout)[name] for name in listed] == list(range(layout.SIZE))


def test_every_measured_file_says_how_it_was_made() -> None:
    assert {path.stem for path in (DOC / "evidence").glob("*.json")} == {*MADE_BY, "made_by"}
    for name, made in MADE_BY.items():
        assert made.keys() == {"command", "seeds", "settings"}
        runs = re.search(r"--runs (\d+)", made["command"])
        rows = json.loads(text_of(DOC / "evidence" / f"{name}.json"))
        assert not runs or max(row["runs"] for row in rows) == int(runs[1]), name


@pytest.mark.parametrize("name", ["distances", "bound", "intervention"])
def test_what_is_quickly_measured_is_what_is_committed(name: str, tmp_path: Path) -> None:
    result = tmp_path / "result.json"
    assert study([*MADE_BY[name]["command"].split()[1:], "--json", str(result)]) == 0
    committed = json.loads(text_of(DOC / "evidence" / f"{name}.json"))
    assert flat(json.loads(result.read_text())) == pytest.approx(flat(committed), rel=1e-6), (
        f"run python doc/generate.py --measure {name}"
    )


def flat(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Return the numbers of a table by row and name."""
    return {
        f"{index} {name}": value
        for index, row in enumerate(rows)
        for name, value in row.items()
        if isinstance(value, (int, float))
    }


def examples(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", text_of(page), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize(
    "code", [*examples(ROOT / "README.md"), *examples(DOC / "python.md")], ids=lambda code: code.splitlines()[0]
)
def test_a_python_example_runs(code: str) -> None:
    three = "pressure_pa in log" in code
    log = [(k * 10**8 if three else 0.1 * k, 80.0 * 0.1 * k, *([0.0] if three else [])) for k in range(20)]
    exec(compile(code, "example", "exec"), {"log": log})


def section(page: str, heading: str) -> str:
    """Return the text of a page below a heading, up to the next one of its rank."""
    return text_of(DOC / page).split(f"\n## {heading}\n")[1].split("\n## ")[0]


def topic_rows() -> set[tuple[str, str]]:
    """Return name and type of every row of the table of topics."""
    rows = re.findall(r"^\| `([^`]+)` \| (\w+/\w+) \|", section("ros_interface.md", "Topics"), re.MULTILINE)
    return {(f"/{name.lstrip('/')}", kind) for name, kind in rows}


def documented(program: str) -> set[str]:
    """Return the parameters that the page of parameters lists for a program."""
    return set(re.findall(r"^\| `([\w.]+)` \|", section("parameters.md", HEADINGS[program]), re.MULTILINE))


def all_nodes(context: Context, folder: Path, reader: BagReader) -> Iterator[tuple[str, Callable[[], Node]]]:
    """Yield every node by its program, set up so that it opens all the topics it ever does."""
    noisy = [Parameter(name, value=0.1) for name in ("speed_std_mps", "wheel_speed_std_radps")]
    for name, make in NODES.items():
        yield name, partial(make, context=context, parameter_overrides=noisy if name == "simulator" else [])
    simulated = [Parameter("use_sim_time", value=True)]
    yield "recorder", lambda: Recorder(folder / "bag", context=context, parameter_overrides=simulated)
    yield "replay", lambda: Replay(reader, select(reader.topics), context=context)
    yield "live", lambda: Live("127.0.0.1", 0, context=context)


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
            assert parameters == documented(program), program
    of_rclpy = {("/rosout", "rcl_interfaces/Log"), ("/parameter_events", "rcl_interfaces/ParameterEvent")}
    assert topic_rows() == opened - of_rclpy

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The launch files: their arguments are those of the page, what they start is there, and they are installed."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml
from conftest import ROOT
from test_diagnostics import NODES
from test_docs import documented, section
from test_package import console_scripts, setup_arguments

from adhesion_node.wire.settings.telling import Telling

LINE, ESTIMATOR = ROOT / "launch" / "line.launch.py", ROOT / "launch" / "estimator.launch.xml"


def in_page(name: str) -> dict[str, str]:
    """Return the default of each argument that the page says a launch file has."""
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \| ([^|]*) \|", section("ros_bringup.md", "Launch files"), re.MULTILINE)
    column = ("line.launch.py", "estimator.launch.xml").index(name)
    return {row[0]: row[1 + column].strip("` ") for row in rows if row[1 + column].strip() != "–"}


def of_python() -> dict[str, Any]:
    """Return the arguments of line.launch.py without importing it; None for a default that is no literal."""
    (table,) = (
        node.value
        for node in ast.parse(LINE.read_text(encoding="utf-8")).body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "ARGUMENTS"
    )
    assert isinstance(table, ast.Dict)
    return {
        ast.literal_eval(name): value.elts[0].value if isinstance(value.elts[0], ast.Constant) else None
        for name, value in zip(table.keys, table.values, strict=True)
        if name is not None and isinstance(value, ast.Tuple)
    }


def test_the_line_takes_what_the_page_says() -> None:
    defaults = in_page(LINE.name)
    assert set(defaults) == {"namespace", "params_file", "use_sim_time", "scenario", "fault", "record", "live"}
    assert of_python() | {"params_file": defaults["params_file"]} == defaults


def test_the_estimator_takes_what_the_page_says() -> None:
    tree = ElementTree.parse(ESTIMATOR).getroot()
    declared = {one.attrib["name"]: one.attrib["default"] for one in tree.findall("arg")}
    defaults = in_page(ESTIMATOR.name)
    assert set(defaults) == {"namespace", "params_file", "use_sim_time"}
    assert declared == defaults | {"params_file": "$(find-pkg-share adhesion_node)/config/defaults.yaml"}
    (node,) = tree.findall("node")
    assert node.attrib["exec"] in console_scripts()
    given = [parameter.attrib for parameter in node.findall("param")]
    assert [next(iter(one)) for one in given] == ["from", "name"], "the file before what is given for itself"
    assert set(re.findall(r"\$\(var (\w+)\)", ESTIMATOR.read_text(encoding="utf-8"))) == declared.keys()


def test_what_the_line_starts_and_sets_is_there() -> None:
    text = LINE.read_text(encoding="utf-8")
    assert set(re.findall(r'node\("(\w+)"', text)) == {"estimator", "atp_monitor", "recorder", "live", "simulator"}
    happening = re.search(r"happening = \{(.*)\}", text)
    assert happening is not None
    assert (
        set(re.findall(r'"(\w+)":', happening[1])) == {"scenario", "fault", "wait_for"} <= set(documented("simulator"))
    )


def test_the_launch_files_are_installed() -> None:
    installed = {(folder, file) for folder, files in setup_arguments()["data_files"] for file in files}
    found = {str(path.relative_to(ROOT)) for path in (ROOT / "launch").iterdir() if path.suffix in (".py", ".xml")}
    assert {("share/adhesion_node/launch", file) for file in found} <= installed
    assert len(found) == 2


@pytest.mark.parametrize("namespace", ["", "train1/"])
@pytest.mark.parametrize("entry", NODES)
def test_every_entry_of_diagnostics_has_one_place_in_the_tree(entry: str, namespace: str) -> None:
    """By the rule of diagnostic_aggregator: a name belongs where it contains one of the words."""
    tree = yaml.safe_load((ROOT / "launch" / "analyzers.yaml").read_text(encoding="utf-8"))["analyzers"]
    analyzers = [one for one in tree["ros__parameters"].values() if isinstance(one, dict)]
    assert {one["type"] for one in analyzers} == {"diagnostic_aggregator/GenericAnalyzer"}
    assert all(one["timeout"] > 2 * Telling().diagnostics_period_s for one in analyzers), "a late word is no silence"
    assert sum(any(word in namespace + entry for word in one["contains"]) for one in analyzers) == 1
    installed = {(folder, file) for folder, files in setup_arguments()["data_files"] for file in files}
    assert ("share/adhesion_node/config", "launch/analyzers.yaml") in installed


@pytest.mark.parametrize("file", [LINE, ESTIMATOR], ids=lambda path: path.name)
def test_launch_reads_the_same(file: Path) -> None:
    """Where launch and launch_ros are installed."""
    pytest.importorskip("launch_ros")
    sources = pytest.importorskip("launch.launch_description_sources")
    described = sources.AnyLaunchDescriptionSource(str(file)).get_launch_description(
        pytest.importorskip("launch").LaunchContext()
    )
    assert {one.name for one in described.get_launch_arguments()} == in_page(file.name).keys()

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The layouts for Foxglove and PlotJuggler: of the form that the programs read, every path a field of a topic of ours.

The form is that of the programs' sources: Lichtblick, the open fork of Foxglove, at 66adecb; PlotJuggler at ddcbd05.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from conftest import ROOT
from rclpy.context import Context
from rosbags.interfaces import Nodetype

from adhesion_node.bag import typestore
from adhesion_node.core.atp.supervision import Reading
from adhesion_node.layouts import ENTRIES, HARDWARE, NAMES
from adhesion_node.layouts.__main__ import main
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.wire.topics import BRAKE_PRESSURE, DIAGNOSTICS, POSITION, RECORDED, RESULTS, SPEED

LAYOUTS = ROOT / "adhesion_node" / "layouts"
TYPES = {f"/{topic.name.lstrip('/')}": topic.type for topic in RECORDED}
FILTER = re.compile(r'\{(\w+)=="[^"]*"\}')

foxglove = json.loads((LAYOUTS / "foxglove.json").read_text(encoding="utf-8"))
plotjuggler = ElementTree.parse(LAYOUTS / "plotjuggler.xml").getroot()


def values(document: Any, keys: tuple[str, ...]) -> Iterator[str]:
    """Yield every text under one of the keys."""
    if isinstance(document, dict):
        for key, value in document.items():
            if key in keys and isinstance(value, str):
                yield value
            else:
                yield from values(value, keys)
    elif isinstance(document, list):
        for item in document:
            yield from values(item, keys)


FOXGLOVE_PATHS = sorted(set(values(foxglove["configById"], ("value", "topicToRender"))))
PLOTJUGGLER_PATHS = sorted(
    {
        curve.get(key, "")
        for curve in plotjuggler.iter("curve")
        for key in (("curve_x", "curve_y") if "curve_x" in curve.attrib else ("name",))
    }
)


def field(type_name: str, name: str, indexed: bool) -> str:
    """Return the type of a field, or of its elements where it is indexed; fails when there is none."""
    fields: dict[str, Any] = dict(typestore().fielddefs[type_name][1])
    assert name in fields, f"{type_name} has no {name}"
    kind, details = fields[name]
    assert indexed is (kind in (Nodetype.ARRAY, Nodetype.SEQUENCE)), f"{type_name}.{name}"
    kind, details = details[0] if indexed else (kind, details)
    return str(details if kind is Nodetype.NAME else details[0])


def resolve(topic: str, steps: list[str]) -> str:
    """Return the type at the end of a path such as points[:].positions[0] or values[:]{key=="mu"}.value."""
    assert topic in TYPES, f"{topic} is no topic of ours"
    found = TYPES[topic]
    for step in steps:
        parts = re.fullmatch(r"(\w+)(\[(?::|\d+)\])?((?:\{.*\})?)", step)
        assert parts is not None, step
        found = field(found, parts[1], parts[2] is not None)
        for key in FILTER.findall(parts[3]):
            field(found, key, False)
    return found


NAME = r"[\w-]+"
MESSAGE_PATH = re.compile(
    rf"(/{NAME})+"
    rf"(\.{NAME}(\[(-?\d+|(-?\d+)?:(-?\d+)?)\])?"
    rf"(\{{{NAME}(\.{NAME})*(==|!=|>=|<=|>|<)(\"[^\"]*\"|'[^']*'|-?\d+|true|false)\}})?)*",
    re.ASCII,
)
"""A topic, then fields, each with at most one index or slice and then one filter."""

TITLES = {"foxglovePanelTitle", "lichtblickPanelTitle"}
PANELS = {  # keys that must be there, keys that may be there
    "Plot": (
        {"paths", "isSynced", "xAxisVal", "showLegend", "legendDisplay", "showPlotValuesInLegend"}
        | {"showXAxisLabels", "showYAxisLabels", "sidebarDimension"},
        {"xAxisPath", "xAxisLabel", "yAxisLabel", "followingViewWidth"}
        | {f"{limit}{axis}Value" for limit in ("min", "max") for axis in "XY"},
    ),
    "StateTransitions": ({"paths", "isSynced"}, {"xAxisRange", "xAxisLabel", "showPoints"}),
    "DiagnosticSummary": (
        {"minLevel", "pinnedIds", "topicToRender", "hardwareIdFilter"},
        {"sortByLevel", "secondsUntilStale"},
    ),
    "DiagnosticStatusPanel": (
        {"topicToRender"},
        {"selectedHardwareId", "selectedName", "splitFraction", "numericPrecision", "secondsUntilStale"},
    ),
}


@pytest.mark.parametrize("panel", foxglove["configById"])
def test_foxglove_knows_the_panel_and_its_settings(panel: str) -> None:
    required, optional = PANELS[panel.partition("!")[0]]
    config = foxglove["configById"][panel]
    assert required | TITLES <= config.keys() <= required | TITLES | optional
    assert len({config[title] for title in TITLES}) == 1
    assert config.get("xAxisVal", "timestamp") in {"timestamp", "index", "custom", "currentCustom"}
    assert config.get("legendDisplay", "none") in {"floating", "top", "left", "none"}
    assert ("xAxisPath" in config) is ("ustom" in config.get("xAxisVal", ""))


def test_foxglove_knows_the_settings_of_a_series() -> None:
    series = [path for config in foxglove["configById"].values() for path in config.get("paths", ())]
    assert series
    for path in series:
        assert (
            {"value", "timestampMethod"}
            <= path.keys()
            <= {*("value", "timestampMethod", "enabled", "label", "color", "showLine", "lineSize")}
        )
        stamped = "header" in dict(typestore().fielddefs[TYPES[path["value"].partition(".")[0]]][1])
        assert path["timestampMethod"] in ({"receiveTime", "headerStamp"} if stamped else {"receiveTime"})


def test_foxglove_accepts_the_layout() -> None:
    for name in ("configById", "globalVariables", "userNodes", "playbackConfig", "layout"):
        assert isinstance(foxglove[name], dict), name
    assert foxglove["playbackConfig"]["speed"] == 1
    for split in splits(foxglove["layout"]):
        assert split.keys() == {"direction", "splitPercentage", "first", "second"}
        assert split["direction"] in {"row", "column"}
        assert 0 < split["splitPercentage"] < 100


def test_the_entry_of_the_atp_monitor_is_selected(context: Context) -> None:
    monitor = AtpMonitor(context=context)
    status = monitor._diagnostics
    config = foxglove["configById"]["DiagnosticStatusPanel!atp"]
    assert (config["selectedHardwareId"], config["selectedName"]) == (status.hardware_id, status.name)


@pytest.mark.parametrize("path", FOXGLOVE_PATHS)
def test_a_foxglove_path_is_well_formed(path: str) -> None:
    assert MESSAGE_PATH.fullmatch(path)


@pytest.mark.parametrize("path", FOXGLOVE_PATHS)
def test_a_foxglove_path_leads_to_a_number_or_a_text(path: str) -> None:
    topic, *steps = re.split(r"\.(?![^{]*\})", path)
    assert resolve(topic, steps) in ({"float64", "string"} if steps else {DIAGNOSTICS.type})


@pytest.mark.parametrize("path", PLOTJUGGLER_PATHS)
def test_a_plotjuggler_path_leads_to_a_number(path: str) -> None:
    topic = max((name for name in TYPES if path.startswith(f"{name}/")), key=len, default=path)
    if TYPES[topic] == DIAGNOSTICS.type:  # PlotJuggler's parser makes /topic/hardware/name/key of it
        assert path.startswith(f"{topic}/{HARDWARE}/{ENTRIES[0]}/")
        assert path.rpartition("/")[2] in Reading._fields
        return
    assert resolve(topic, path.removeprefix(f"{topic}/").split("/")) == "float64"


@pytest.mark.parametrize("paths", [FOXGLOVE_PATHS, PLOTJUGGLER_PATHS], ids=["foxglove", "plotjuggler"])
def test_what_matters_is_shown(paths: list[str]) -> None:
    for topic in ("/adhesion/mu", "/adhesion/mu_lower", "/adhesion/state", "/brake_pressure", "/speed", "/truth/mu"):
        assert any(path.startswith(topic) for path in paths), topic


def test_foxglove_shows_every_sensor_and_result() -> None:
    shown = {path.split(".")[0] for path in FOXGLOVE_PATHS}
    nominal = "/adhesion/braking_curve_nominal"  # a plot has one x axis; the safe curve is the one to see
    assert {f"/{topic.name}" for topic in (POSITION, BRAKE_PRESSURE, SPEED, *RESULTS)} - {nominal} <= shown


@pytest.mark.parametrize("paths", [FOXGLOVE_PATHS, PLOTJUGGLER_PATHS], ids=["foxglove", "plotjuggler"])
def test_the_limits_are_shown_over_the_distance_to_the_target(paths: list[str]) -> None:
    for key in ("distance_to_target_m", "permitted_mps", "warning_mps", "sbi_mps", "ebi_mps"):
        assert any(path.startswith("/atp/status") and key in path for path in paths), key


def test_regimes_and_the_fit_are_shown() -> None:
    assert any("regime" in path for path in FOXGLOVE_PATHS)
    assert any("log_likelihood" in path for path in FOXGLOVE_PATHS)


def test_a_namespace_stands_in_every_path(tmp_path: Path, context: Context) -> None:
    assert main(["--namespace", "/line/train1", "--output", str(tmp_path)]) == 0
    written = {name: (tmp_path / name).read_text(encoding="utf-8") for name in NAMES}
    paths = list(values(json.loads(written["foxglove.json"])["configById"], ("value", "topicToRender")))
    root = ElementTree.fromstring(written["plotjuggler.xml"])
    paths += [value for curve in root.iter("curve") for value in curve.attrib.values() if value.startswith("/")]
    for path in paths:
        assert path.startswith(("/line/train1/", "/diagnostics")), path
    monitor = AtpMonitor(context=context, namespace="/line/train1")._diagnostics
    config = json.loads(written["foxglove.json"])["configById"]["DiagnosticStatusPanel!atp"]
    assert (config["selectedHardwareId"], config["selectedName"]) == (monitor.hardware_id, monitor.name)
    assert f"/line/train1/atp/status/{monitor.hardware_id}/{monitor.name}/ebi_mps" in written["plotjuggler.xml"]
    assert 'name==\\"line/train1/estimator/adhesion\\"' in written["foxglove.json"]


def splits(layout: Any) -> list[dict[str, Any]]:
    if isinstance(layout, str):
        return []
    return [layout, *splits(layout["first"]), *splits(layout["second"])]


def leaves(layout: Any) -> list[str]:
    return [layout] if isinstance(layout, str) else leaves(layout["first"]) + leaves(layout["second"])


def test_the_panels_of_foxglove_are_those_of_its_arrangement() -> None:
    assert sorted(leaves(foxglove["layout"])) == sorted(foxglove["configById"])


CHILDREN = {  # element: (attributes that must be there, elements that may stand in it)
    "root": (set(), {"tabbed_widget", "use_relative_time_offset"}),
    "tabbed_widget": ({"name", "parent"}, {"Tab", "currentTabIndex"}),
    "Tab": ({"tab_name", "containers"}, {"Container"}),
    "Container": (set(), {"DockSplitter"}),
    "DockSplitter": ({"orientation", "sizes", "count"}, {"DockSplitter", "DockArea"}),
    "DockArea": ({"name"}, {"plot"}),
    "plot": ({"mode", "style", "flip_x", "flip_y"}, {"range", "limitY", "curve"}),
    "limitY": (set(), set()),
    "curve": ({"name", "color"}, set()),
    "currentTabIndex": ({"index"}, set()),
    "use_relative_time_offset": ({"enabled"}, set()),
}


def test_plotjuggler_knows_every_element() -> None:
    for element in plotjuggler.iter():
        required, children = CHILDREN[element.tag]
        assert required <= element.attrib.keys(), element.tag
        assert {child.tag for child in element} <= children, element.tag
    (main,) = plotjuggler.iter("tabbed_widget")
    assert (main.get("name"), main.get("parent")) == ("Main Window", "main_window")
    assert {splitter.get("orientation") for splitter in plotjuggler.iter("DockSplitter")} <= {"|", "-"}
    assert all(len(area) == 1 for area in plotjuggler.iter("DockArea"))


def test_the_curves_of_plotjuggler_fit_their_plots() -> None:
    for plot in plotjuggler.iter("plot"):
        assert plot.get("style") in {"Lines", "Dots", "LinesAndDots", "Sticks", "Steps", "StepsInv"}
        kind = {"TimeSeries": {"name", "color"}, "XYPlot": {"name", "color", "curve_x", "curve_y"}}[plot.attrib["mode"]]
        for curve in plot.iter("curve"):
            assert curve.attrib.keys() == kind
            assert re.fullmatch("#[0-9a-f]{6}", curve.attrib["color"])
            if "curve_x" in kind:  # both must have the same stamps, so they are of one message
                topic = next(name for name in TYPES if curve.attrib["curve_x"].startswith(f"{name}/"))
                assert curve.attrib["curve_y"].startswith(f"{topic}/")


def test_the_splitters_of_plotjuggler_hold_what_they_count() -> None:
    splitters = list(plotjuggler.iter("DockSplitter"))
    assert splitters
    for splitter in splitters:
        assert int(splitter.attrib["count"]) == len(splitter) == len(splitter.attrib["sizes"].split(";"))


def test_the_layouts_are_installed() -> None:
    from test_package import setup_arguments

    installed = {(folder, Path(file).name) for folder, files in setup_arguments()["data_files"] for file in files}
    for name in ("foxglove.json", "plotjuggler.xml"):
        assert ("share/adhesion_node/layouts", name) in installed


@pytest.mark.parametrize("namespace", ["a b", "/\u00dc", "/1st", "/a//b"])
def test_what_can_be_no_namespace_is_refused(
    namespace: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--namespace", namespace, "--output", str(tmp_path / "new")]) == 2
    assert "give names of letters, digits and _, as /train1 or /line/train1" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()

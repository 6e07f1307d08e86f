"""The layouts for Foxglove and PlotJuggler: whole, and every path in them is a field of a topic of ours."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from conftest import ROOT
from rosbags.interfaces import Nodetype

from adhesion_node.bag import typestore
from adhesion_node.topics import DIAGNOSTICS, RECORDED, RESULTS, SENSORS

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


@pytest.mark.parametrize("path", FOXGLOVE_PATHS)
def test_a_foxglove_path_leads_to_a_number_or_a_text(path: str) -> None:
    topic, *steps = re.split(r"\.(?![^{]*\})", path)
    assert resolve(topic, steps) in ({"float64", "string"} if steps else {DIAGNOSTICS.type})


@pytest.mark.parametrize("path", PLOTJUGGLER_PATHS)
def test_a_plotjuggler_path_leads_to_a_number(path: str) -> None:
    topic = max((name for name in TYPES if path.startswith(f"{name}/")), key=len, default=path)
    assert resolve(topic, path.removeprefix(f"{topic}/").split("/")) == "float64"


@pytest.mark.parametrize("paths", [FOXGLOVE_PATHS, PLOTJUGGLER_PATHS], ids=["foxglove", "plotjuggler"])
def test_what_matters_is_shown(paths: list[str]) -> None:
    for topic in ("/adhesion/mu", "/adhesion/mu_lower", "/adhesion/state", "/brake_pressure", "/speed", "/truth/mu"):
        assert any(path.startswith(topic) for path in paths), topic


def test_foxglove_shows_every_sensor_and_result() -> None:
    shown = {path.split(".")[0] for path in FOXGLOVE_PATHS}
    nominal = "/adhesion/braking_curve_nominal"  # a plot has one x axis; the safe curve is the one to see
    assert {f"/{topic.name}" for topic in (*SENSORS, *RESULTS)} - {nominal} <= shown


def leaves(layout: Any) -> list[str]:
    return [layout] if isinstance(layout, str) else leaves(layout["first"]) + leaves(layout["second"])


def test_the_panels_of_foxglove_are_those_of_its_arrangement() -> None:
    assert sorted(leaves(foxglove["layout"])) == sorted(foxglove["configById"])


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

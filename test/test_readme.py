"""The README says what the code does: parameters, distances, topics."""

from __future__ import annotations

import re

import pytest
from conftest import ROOT

from adhesion_node import topics
from adhesion_node.core.setting import Setting
from adhesion_node.nodes import atp_monitor, estimator, qos
from adhesion_node.settings import SETTINGS
from adhesion_node.study import distances

README = (ROOT / "README.md").read_text(encoding="utf-8")


def parameter_row(setting: Setting) -> str:
    """Return the line of the parameter table that describes a setting."""
    default = f"{setting.default:.6g}" if isinstance(setting.default, float) else str(setting.default).lower()
    if setting.choices:
        allowed = ", ".join(setting.choices)
    elif isinstance(setting.default, bool):
        allowed = "true, false"
    elif isinstance(setting.default, str):
        allowed = "text"
    else:
        allowed = f"{setting.low:g} to {setting.high:g}"
    return f"| `{setting.name}` | {default} | {setting.unit} | {allowed} | {setting.description} |"


TABLES = {"### Parameters of the estimator": SETTINGS, "### Parameters of the ATP monitor": atp_monitor.SETTINGS}


@pytest.mark.parametrize("heading", TABLES)
def test_the_parameter_table_is_that_of_the_code(heading: str) -> None:
    section = README.split(f"\n{heading}\n")[1].split("\n##")[0]
    rows = re.findall(r"^\| `.+\|$", section, flags=re.MULTILINE)
    expected = [parameter_row(setting) for setting in TABLES[heading]]
    assert rows == expected, "the table must read:\n" + "\n".join(expected)


@pytest.mark.parametrize("topic", [*topics.SENSORS, *topics.TRUTH, *topics.RESULTS, topics.ATP_STATUS])
def test_every_topic_stands_in_the_readme(topic: topics.Topic) -> None:
    package, _, name = topic.type.split("/")
    rows = [line for line in README.splitlines() if line.startswith("| ") and f"`{topic.name}`" in line]
    assert any(name in row and package in row for row in rows)


@pytest.mark.parametrize("topic", estimator.OUTPUTS)
def test_the_readme_names_the_quality_of_service(topic: topics.Topic) -> None:
    section = README.split("\n## Topics\n")[1].split("\n## ")[0]
    (row,) = (
        line for line in section.splitlines() if line.startswith("| ") and f"`{topic.name}`" in line.split("|")[1]
    )
    assert row.split(" | ")[2] == ("latched" if estimator.OUTPUTS[topic] is qos.EXPIRING else "result")


@pytest.mark.parametrize("row", distances.rows(), ids=lambda row: f"{row['from_kmh']}-{row['case']}")
def test_the_distances_are_those_of_the_study(row: dict[str, float]) -> None:
    line = (
        f"| {row['from_kmh']} → {row['to_kmh']} | {row['case']} | {row['distance_m']:.1f} | "
        f"{row['paper_distance_m']:.1f} | {row['time_s']:.1f} | {row['paper_time_s']:.1f} |"
    )
    assert line in README

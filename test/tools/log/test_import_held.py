# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Values that a slow receiver repeats in every row count once; those of a coarse resolution count in every row."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

from adhesion_node.nodes import replay
from adhesion_node.tools import import_csv

__all__ = ["importing"]


def measured(seconds: int = 60) -> pd.DataFrame:
    """The ride as sensors measure it, by positions to 0.5 m and speeds to 0.05 m/s, and a latitude of them."""
    rng, rows = np.random.default_rng(7), ride(seconds)
    rows["position"] += rng.normal(0.0, 0.5, len(rows))
    rows["speed"] += rng.normal(0.0, 0.05, len(rows))
    return rows.assign(lat=47.0 + rows.position / 111_181.0, lon=8.0).round({"position": 2, "speed": 4, "lat": 7})


def at_rate(rows: pd.DataFrame, names: list[str], every: int) -> pd.DataFrame:
    """Measured in every so manieth row, and in the others not."""
    missing = pd.DataFrame(dict.fromkeys(names, np.arange(len(rows)) % every > 0))
    return rows.assign(**{name: rows[name].mask(missing[name]) for name in names})


@pytest.mark.parametrize("every", [2, 5, 10])
@pytest.mark.parametrize("names", [["position"], ["speed"], ["position", "speed"], ["lat", "lon", "speed"]], ids=str)
def test_a_held_value_is_measured_once(
    importing: Import, capsys: pytest.CaptureFixture[str], names: list[str], every: int
) -> None:
    keep = ["time", "brake_pressure", *names]
    slow = at_rate(measured(), names, every)[keep]
    importing(text(slow))
    expected = [list(map(repr, importing.messages(topic))) for topic in importing.summary["messages"]]
    importing.output = importing.output.with_name("held")
    importing(text(slow.ffill()))
    assert [list(map(repr, importing.messages(topic))) for topic in importing.summary["messages"]] == expected
    held = (
        f"{names[0]}: {600 - 600 // every} of 600 rows repeat the one before, a new one comes every {every / 10:g} s: "
    )
    assert any(line.startswith(held + "left out") for line in read_as(importing, capsys))


def test_a_speed_is_held_where_it_changes_with_the_place_alone(importing: Import) -> None:
    """In whole km/h it tells that not by itself."""
    rows = measured().assign(speed=(3.6 * ride().speed).round())
    assert importing(text(at_rate(rows, ["position", "speed"], 10).ffill()), "--speed-unit", "kmh") == 0
    assert importing.summary["messages"] == {"/brake_pressure": 600, "/position": 60, "/speed": 60, "/fix": 600}


def walking(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.assign(position=(1000.0 + 1.4 * rows.time + 0.05 * rows.time.clip(upper=20.0) ** 2))


MEASURED: list[tuple[str, Callable[[pd.DataFrame], pd.DataFrame]]] = [
    ("speeds in whole km/h", lambda rows: rows.assign(speed=(3.6 * ride().speed).round() / 3.6)),
    ("noisy speeds in whole km/h", lambda rows: rows.assign(speed=(3.6 * rows.speed).round() / 3.6)),
    ("whole metres at walking pace", lambda rows: walking(rows).round({"position": 0}).drop(columns="speed")),
    ("feet at walking pace", lambda rows: rows.assign(position=(walking(rows).position / 0.3).round() * 0.3)),
    ("noisy whole metres", lambda rows: rows.assign(position=rows.position.diff().cumsum().fillna(0.0).round() / 10)),
    ("a train that stands", lambda rows: rows.assign(position=1000.0, speed=0.0)),
    ("a train that stops", lambda rows: rows.assign(speed=rows.speed.where(rows.time < 30.0, 0.0))),
    ("tenths of a kilometre", lambda rows: rows.assign(position=rows.position.round(-2))),
    ("one sensor that froze", lambda rows: rows.assign(position=rows.position.where(rows.time < 40.0, 2900.0))),
]


@pytest.mark.parametrize("change", [case[1] for case in MEASURED], ids=[case[0] for case in MEASURED])
def test_what_repeats_otherwise_is_kept(importing: Import, change: Callable[[pd.DataFrame], pd.DataFrame]) -> None:
    rows = change(measured().drop(columns=["lat", "lon"]))
    importing(text(rows))
    assert importing.summary["empty"] == {}
    assert len(importing.messages("position")) == 600


def test_a_receiver_that_stands_goes_on_to_tell_where(importing: Import) -> None:
    rows = at_rate(measured(), ["position"], 10).ffill()
    rows["position"] = rows.position.where(rows.time < 30.0, 2300.0)
    importing(text(rows[["time", "position", "brake_pressure"]]))
    late = [sample for sample in importing.positions() if sample.t_ns >= 30 * 10**9]
    assert len(late) == 20, "one for each time and a half that a value is held"


def test_the_adhesion_of_held_positions_is_that_of_all(importing: Import, capsys: pytest.CaptureFixture[str]) -> None:
    found = []
    for name, every in (("all", 1), ("held", 10), ("twice a second", 5)):
        importing.output = importing.output.with_name(name)
        rows = at_rate(measured(65), ["position"], every).ffill()
        assert importing(text(rows[["time", "position", "brake_pressure"]])) == 0
        result = importing.output.with_name(f"{name}.json")
        replay.main([str(importing.output), "--offline", "--json", str(result)])
        capsys.readouterr()
        found.append(json.loads(result.read_text(encoding="utf-8")))
    assert all(result["dropped"] == {} for result in found)
    assert [result["mu_final"] for result in found] == pytest.approx([found[0]["mu_final"]] * 3, rel=0.1)


def test_a_dry_run_writes_what_was_left_out_on_standard_output(
    importing: Import, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = at_rate(measured(), ["position"], 10).ffill()[["time", "position"]]
    importing(text(rows))
    assert import_csv.main([str(importing.log), "--dry-run"]) == 0
    assert "540 without position" in capsys.readouterr().out

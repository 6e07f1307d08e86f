# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A run of several brakings: one row for each, claims that held to its end, gaps, peaks, events."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cdrs
import messages
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import serialize_message
from slowing import FREE, START_NS, S, read
from std_msgs.msg import Float64
from test_offline import samples, write_run

from adhesion_node.bag import BagReader, BagWriter, select_from
from adhesion_node.core import Config
from adhesion_node.report.drawn.page_data import MOST_MOMENTS, Subject, chart_data
from adhesion_node.report.drawn.thinning import peaks, with_gaps
from adhesion_node.report.found.brakings import brakings
from adhesion_node.report.found.events import events
from adhesion_node.report.found.findings import findings
from adhesion_node.report.read.estimated import estimate_run
from adhesion_node.report.read.run import Run
from adhesion_node.report.read.series import NONE, Series
from adhesion_node.run import offline
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.run.results.brakings import brakings as of_predictions
from adhesion_node.run.results.score import Truth
from adhesion_node.wire.line import NOMINAL
from adhesion_node.wire.settings.setup import setup_of
from adhesion_node.wire.topics import (
    ATP_STATUS,
    BRAKE_PRESSURE,
    DIAGNOSTICS,
    MU,
    MU_LOWER,
    STATE,
    TRUTH_MU,
    TRUTH_STATE,
)

BRAKE_S, PAUSE_S = 30, 600
"""Each braking, from 80 m/s to 22 m/s; and from its beginning to that of the next one."""


def journey(path: Path, brakings_: int = 3) -> Path:
    """Record brakings with nothing between them. In the second the rail changes after 20 s, and the bound is broken."""
    place = 0.0
    with BagWriter(path) as writer:
        for number in range(brakings_):
            for second in range(BRAKE_S):
                t_ns = START_NS + (number * PAUSE_S + second) * S
                worse = number == 1 and second >= 20
                speed, true = 80.0 - 2.0 * second, 0.06 if worse else 0.1
                place += speed
                level = "EMERGENCY_BRAKE" if worse else "NORMAL"
                regime = ("COASTING", "BRAKE_LIMITED", "ADHESION_LIMITED")[(second > 3) + (number != 2 and second > 5)]
                told = {"regime": regime, "changes": str(int(worse or number > 1))}
                for topic, message in (
                    (TRUTH_STATE, messages.state_message(t_ns, place, 0.0, speed, 0.0)),
                    (TRUTH_MU, Float64(data=true)),
                    (MU, Float64(data=0.09)),
                    (MU_LOWER, Float64(data=0.03 if worse and second != 21 else 0.08)),
                    (STATE, messages.state_message(t_ns, place, 1.0, speed, 1.0)),
                    (DIAGNOSTICS, status(t_ns, told)),
                    (ATP_STATUS, status(t_ns, {"level": level})),
                ):
                    writer.write(f"/{topic.name.lstrip('/')}", topic.type, serialize_message(message), t_ns)
                cdr = cdrs.brake_pressure(t_ns, 101_325.0 + 410e3)
                writer.write(f"/{BRAKE_PRESSURE.name}", BRAKE_PRESSURE.type, cdr, t_ns)
    return path


def status(t_ns: int, values: dict[str, str]) -> Any:
    entry = DiagnosticStatus(values=[KeyValue(key=key, value=value) for key, value in values.items()])
    return DiagnosticArray(header=messages.header(t_ns), status=[entry])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return read(journey(tmp_path_factory.mktemp("journey") / "bag"))


def test_a_run_is_split_into_its_brakings(run: Run) -> None:
    found = brakings(run)
    assert [(part.first, part.last) for part in found] == [(0, 29), (30, 59), (60, 89)]
    assert brakings(run._replace(pressure=NONE))[0].last == 29, "by the speed, where no pressure is recorded"
    assert brakings(run._replace(speed=run.speed.map(np.ones_like))) == []


def test_a_table_of_brakings_has_those_of_the_report(tmp_path: Path) -> None:
    """One brakes by what is recorded of the pressure, the other by what the estimator says: it is one braking."""
    write_run(tmp_path / "bag", samples())
    with BagReader(tmp_path / "bag") as reader:
        selection = select_from(reader, [])
        made = offline.replay(Pipeline(Config(), 1), Truth(), offline.messages(reader, selection, NOMINAL)).predictions
        run, *_ = estimate_run(reader, selection, setup_of({"seed": 1}), lambda _: None)
    (row,) = (one.row for one in of_predictions(made))
    (part,) = brakings(run)
    assert abs(part.start_ns - int(row["t_ns"][0])) <= S
    assert float(row["from_kmh"][0]) == pytest.approx(3.6 * float(run.speed.values[part.first]), abs=5.0)
    assert float(row["to_kmh"][0]) == pytest.approx(3.6 * float(run.speed.values[part.last]), abs=5.0)


def test_each_braking_has_its_row(run: Run) -> None:
    rows = findings(run, Config(train=FREE), 60.0)["brakings"]
    assert [round(row["start_s"]) for row in rows] == [0, 600, 1200]
    assert [round(row["from_kmh"]) for row in rows] == [288] * 3
    assert [row["mu_low"] for row in rows] == [0.09, 0.09, None]
    assert [row["mu_at_least"] for row in rows] == [0.09] * 3
    assert [row["changes_s"] for row in rows] == [[], [620.0], []]
    assert [round(row["bound_kept_percent"]) for row in rows] == [100, 97, 100]


def test_a_saving_counts_only_as_far_as_it_held_to_the_end_of_its_braking(run: Run) -> None:
    """At the first identified estimate both brakings promised the same; the change of the rail took it back."""
    first, second, third = findings(run, Config(train=FREE), 60.0)["brakings"]
    speed, target = first["identified_at_kmh"] / 3.6, 60.0 / 3.6
    way = (speed**2 - target**2) / (2 * 9.8)
    assert first["fixed_m"] == pytest.approx(way / 0.0726)
    assert first["identified_at_kmh"] == second["identified_at_kmh"]
    assert first["saved_at_least_m"] < way * (1 / 0.0726 - 1 / 0.08) + 1e-6
    assert second["saved_at_least_m"] < first["saved_at_least_m"] - 100.0
    assert third["saved_at_least_m"] is third["fixed_m"] is None


def test_findings_are_of_all_brakings(run: Run) -> None:
    found = findings(run, Config(train=FREE), 60.0)
    assert found["bound_kept_percent"] == pytest.approx(100.0 * 89 / 90)
    assert found["bound_compared"] == 90
    assert found["changes_s"] == [620.0]
    assert found["interventions"] == [{"s": 620.0, "level": "EMERGENCY_BRAKE"}]
    assert findings(run._replace(true_mu=NONE), Config(train=FREE), 60.0)["bound_kept_percent"] is None


def test_the_bound_is_held_against_the_mean_of_a_second(run: Run) -> None:
    """As `study real` does: by its cycle slide protection swings what is used about what it stops the train by."""
    times = np.arange(run.speed.t_ns[0], run.speed.t_ns[-1] + 1, S // 10)
    swings = run._replace(true_mu=Series(times, 0.09 + 0.03 * np.sin(np.arange(times.size) * np.pi / 2.0 + 0.5)))
    assert findings(swings, Config(train=FREE), 60.0)["bound_kept_percent"] == 100.0
    lower = swings._replace(true_mu=swings.true_mu.map(lambda mu: mu - 0.04))
    assert findings(lower, Config(train=FREE), 60.0)["bound_kept_percent"] < 50.0


def test_events_in_their_order(run: Run) -> None:
    told = [(round((t_ns - run.origin_ns) / S), kind, said) for t_ns, kind, said in events(run)]
    assert told[:4] == [
        (0, "level", "NORMAL"),
        (0, "regime", "nothing is claimed"),
        (4, "regime", "the brake limits"),
        (6, "regime", "the adhesion limits"),
    ]
    assert (620, "change", "the rail has changed") in told
    assert (620, "intervention", "EMERGENCY BRAKE") in told


def test_a_gap_is_no_line() -> None:
    series = with_gaps(Series(np.array([0, 1, 2, 600, 601]) * S, np.arange(5.0)))
    assert np.isnan(series.values).tolist() == [False, False, False, True, False, False]
    assert 2 * S < series.t_ns[3] < 600 * S


def test_no_peak_is_lost() -> None:
    values = np.sin(np.linspace(0.0, 9.0, 100_000))
    values[[31_337, 77_777]] = 5.0, -5.0
    values[50_000:50_100] = np.nan
    kept = peaks(values, 1000)
    assert kept.size < 1100
    assert {31_337, 77_777} <= set(kept.tolist())
    assert np.isnan(values[kept]).any(), "the gap is kept"
    assert np.all(np.diff(kept) > 0)


def test_a_long_run_has_its_moments_under_the_brake(run: Run) -> None:
    data = chart_data(Subject("bag", "as recorded", run, Config(train=FREE)), 60.0)
    assert data["brakings"] == [[0.0, 29.0], [600.0, 629.0], [1200.0, 1229.0]]
    assert len(data["moments"]) == 90 <= MOST_MOMENTS
    (speed,) = (line for line in data["charts"][1]["lines"] if line["label"] == "estimated")
    assert [x for x, y in zip(speed["x"], speed["y"], strict=True) if y is None] == pytest.approx([314.5, 914.5])

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The table of a recorded run and its distances: closed forms, and only what was identified."""

from __future__ import annotations

from pathlib import Path

import messages
import numpy as np
import pytest
from slowing import FREE, START_NS, TRUTH, S, read, record, recorded, rows
from test_convert import as_rosbags

from adhesion_node.bag import BagWriter
from adhesion_node.bag.types import serialize
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.report.drawn.table import NO_ROWS, ROWS, table
from adhesion_node.report.found.distances import distance_to_target, distances, true_way
from adhesion_node.report.read.run import Run
from adhesion_node.report.read.series import NONE
from adhesion_node.wire.topics import BRAKING_CURVE, BRAKING_CURVE_NOMINAL

__all__ = ["recorded"]


def test_the_true_way_to_the_target_begins_where_the_last_braking_does(recorded: Run) -> None:
    way = true_way(recorded, 50.0)  # reached after 15 s
    assert way.t_ns.tolist() == [START_NS + second * S for second in range(16)]
    assert way.values.tolist() == [975.0 - (80.0 * second - second**2) for second in range(16)]
    released = np.array([second < 3 or 6 <= second < 10 or second == 12 for second in range(20)])
    pressure = recorded.pressure._replace(values=np.where(released, 0.0, 410e3))
    assert true_way(recorded._replace(pressure=pressure), 50.0).t_ns[0] == START_NS + 10 * S  # a dump is no release
    for none in (recorded._replace(true_speed=NONE), recorded._replace(pressure=NONE), read_only_fast(recorded)):
        assert not true_way(none, 50.0).t_ns.size


def read_only_fast(run: Run) -> Run:
    """The same run, cut before it is slow."""
    return run._replace(true_speed=run.true_speed.map(lambda speed: speed + 100.0))


def curve(second: int, length_m: float) -> bytes:
    """Return a braking curve of that second, by hand: as it runs to 60, 40 and 0 m/s, it passes 50 at 2 lengths."""
    speeds = np.array([80.0 - 2.0 * second, 60.0, 40.0, 0.0])
    places = length_m * np.array([0.0, 1.0, 3.0, 9.0])
    slowing = np.diff(speeds**2) / (-2.0 * np.diff(places))
    by_hand = BrakingCurve(places, speeds, np.resize([slowing.min(), slowing.max()], 4), np.arange(4.0))
    message = messages.curve_message(START_NS + second * S, by_hand, 70.0)
    return serialize(as_rosbags(message, BRAKING_CURVE.type), BRAKING_CURVE.type)


def test_distances_are_those_of_the_recorded_curves_and_of_the_present_mu_where_there_is_none(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for second in range(20):
            curves = [(BRAKING_CURVE_NOMINAL, curve(second, 100.0 + second)), (BRAKING_CURVE, curve(second, 200.0))]
            for topic, cdr in [*rows(second), *(curves if second in (3, 4) else [])]:
                writer.write(f"/{topic.name.lstrip('/')}", topic.type, cdr, START_NS + second * S)
    run = read(tmp_path / "bag")
    planned = distances(run, 50.0, FREE)
    ways = np.maximum((80.0 - 2.0 * np.arange(20)) ** 2 - 50.0**2, 0.0) / (2 * 9.8)
    identified, longest = ways / 0.09, ways / 0.08
    identified[[3, 4]], longest[[3, 4]] = (206.0, 208.0), 400.0
    assert planned.fixed == pytest.approx(ways / 0.0726)
    assert planned.identified == pytest.approx(identified)
    assert planned.longest == pytest.approx(longest)
    faster = distances(run, 80.0, FREE)
    assert not np.any([faster.identified, faster.longest]), "no way to a speed that the train is below"
    shown = {line.split()[0]: line.split()[5:7] for line in table(run, 180.0, FREE).splitlines()[2:]}
    assert shown["259"] == ["208", "400"]


def test_distances_are_the_closed_form(recorded: Run) -> None:
    lengths = distance_to_target(recorded, 0.0726, 50.0, FREE)
    speeds = 80.0 - 2.0 * np.arange(20)
    assert lengths == pytest.approx(np.maximum(speeds**2 - 50.0**2, 0.0) / (2 * 0.0726 * 9.8))
    growing = np.linspace(0.05, 0.09, 20)
    assert distance_to_target(recorded, growing, 0.0, FREE) == pytest.approx(speeds**2 / (2 * growing * 9.8))


def test_the_table_holds_the_runs_numbers(recorded: Run) -> None:
    lines = table(recorded, 180.0, FREE).splitlines()
    assert "braking distance to 180 km/h" in lines[0]
    assert "fixed 0.0726" in lines[1]
    body = [[float(cell) for cell in line.split()] for line in lines[2:]]
    assert len(body) == ROWS
    assert [row[0] for row in body] == sorted((row[0] for row in body), reverse=True)
    for kmh, *mus, left, identified, at_least, fixed in body:
        second = round((80.0 - kmh / 3.6) / 2.0)
        speed = 80.0 - 2.0 * second
        assert mus == [0.1, 0.09, 0.08]
        assert left == round((speed**2 - 50.0**2) / 4.0)  # v^2/(2 a) at 2 m/s^2, from the truth
        for distance, mu in ((identified, 0.09), (at_least, 0.08), (fixed, 0.0726)):
            assert distance == pytest.approx((speed**2 - 50.0**2) / (2 * mu * 9.8), abs=0.51)


def test_the_table_leaves_the_truth_out_where_there_is_none(tmp_path: Path) -> None:
    run_ = read(record(tmp_path / "bag", *TRUTH))
    _, names, *lines = table(run_, 180.0, FREE).splitlines()
    assert "true" not in names
    body = [[float(cell) for cell in line.split()] for line in lines]
    assert {len(row) for row in body} == {6}
    assert {tuple(row[1:3]) for row in body} == {(0.09, 0.08)}


def test_a_train_that_uses_no_adhesion_has_no_true_one(recorded: Run) -> None:
    coasting = recorded._replace(true_mu=recorded.true_mu.map(np.zeros_like))
    body = [line.split() for line in table(coasting, 180.0, FREE).splitlines()[2:]]
    assert {row[1] for row in body} == {"–"}
    assert "–" not in {row[4] for row in body}, "the way that it went is known"


def test_a_run_that_never_slows_down_has_no_rows(tmp_path: Path) -> None:
    assert table(read(record(tmp_path / "bag", seconds=1)), 100.0) == NO_ROWS


def test_an_adhesion_that_is_only_believed_is_not_called_identified(recorded: Run) -> None:
    at_least = recorded.mu_lower.map(lambda bound: np.full_like(bound, 0.02))
    coasting = recorded.regime.map(lambda regimes: np.full_like(regimes, "COASTING"))
    believed = recorded._replace(mu_lower=at_least, regime=coasting)
    body = [line.split() for line in table(believed, 180.0, FREE).splitlines()[2:]]
    assert {(row[2], row[5]) for row in body} == {("–", "–")}
    assert {row[3] for row in body} == {"0.0200"}, "the bound is counted on all the same"
    claimed = [line.split() for line in table(believed._replace(regime=recorded.regime), 180.0, FREE).splitlines()[2:]]
    assert {row[2] for row in claimed if float(row[0]) < 250} == {"0.0900"}, "the adhesion limits: however low it is"
    backwards = recorded._replace(
        speed=recorded.speed.map(np.negative)
    )  # so the report says that nothing is identified
    body = [line.split() for line in table(backwards, 180.0, FREE).splitlines()[2:]]
    assert {(row[2], row[5]) for row in body} == {("–", "–")}

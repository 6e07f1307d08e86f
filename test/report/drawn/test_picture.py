# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The picture and the table of a recorded run: drawn whole, with and without the truth, and right numbers in it."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import cdrs
import messages
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from matplotlib.image import imread
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64
from test_convert import as_rosbags

from adhesion_node.bag import BagReader, BagWriter
from adhesion_node.bag.types import serialize
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.core.physics.train import Train
from adhesion_node.report.drawn import picture
from adhesion_node.report.drawn.charts import Chart, Line
from adhesion_node.report.drawn.table import NO_ROWS, ROWS, table
from adhesion_node.report.found.distances import distance_to_target, distances, true_way
from adhesion_node.report.found.regimes import Band
from adhesion_node.report.read.recorded import read_run
from adhesion_node.report.read.run import Run
from adhesion_node.report.read.series import NONE, Series
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import (
    BRAKE_PRESSURE,
    BRAKING_CURVE,
    BRAKING_CURVE_NOMINAL,
    DECELERATION,
    DIAGNOSTICS,
    MU,
    MU_LOWER,
    STATE,
    TRUTH_MU,
    TRUTH_STATE,
)

S = 10**9
START_NS = 1_700_000_000 * S

FREE = Train(resistance_c0=0.0, resistance_c1=0.0, resistance_c2=0.0)
"""Rolls without resistance, so that distances have a closed form."""

TRUTH = (TRUTH_MU, TRUTH_STATE)


def rows(second: int, space: str = "", **told: str) -> list[tuple[Topic, bytes]]:
    """Return a second of a run: 20 s from 80 m/s at 2 m/s^2, true adhesion 0.1, 0.09 identified, at least 0.08."""
    t_ns = START_NS + second * S
    speed, place = 80.0 - 2.0 * second, 80.0 * second - second**2
    regime = "COASTING" if second < 5 else "ADHESION_LIMITED"
    values = [KeyValue(key=key, value=value) for key, value in {"regime": regime, **told}.items()]
    status = DiagnosticStatus(name=f"{space}/estimator/adhesion".lstrip("/"), values=values)
    plain: tuple[tuple[Topic, Any], ...] = (
        (TRUTH_STATE, messages.state_message(t_ns, place, 0.0, speed, 0.0)),
        (TRUTH_MU, Float64(data=0.1)),
        (MU, Float64(data=0.09)),
        (MU_LOWER, Float64(data=0.08)),
        (STATE, messages.state_message(t_ns, place, 1.0, speed, 1.0)),
        (DIAGNOSTICS, DiagnosticArray(header=messages.header(t_ns), status=[status])),
    )
    pressure = BRAKE_PRESSURE, cdrs.brake_pressure(t_ns, 101_325.0 + 410e3)
    return [pressure, *((topic, serialize_message(message)) for topic, message in plain)]


def record(path: Path, *left_out: Topic, seconds: int = 20, namespaces: Sequence[str] = ("",)) -> Path:
    """Record a run, or the same of several trains."""
    with BagWriter(path) as writer:
        for second, space in product(range(seconds), namespaces):
            for topic, cdr in rows(second, space):
                if topic not in left_out:
                    name = topic.name if topic is DIAGNOSTICS else f"{space}/{topic.name}"
                    writer.write(name, topic.type, cdr, START_NS + second * S)
    return path


def read(path: Path) -> Run:
    with BagReader(path) as reader:
        return read_run(reader)


def png_size(path: Path) -> tuple[int, ...]:
    content = path.read_bytes()
    assert content.startswith(b"\x89PNG\r\n\x1a\n")
    assert content.rstrip().endswith(b"IEND\xaeB`\x82")
    return struct.unpack(">II", content[16:24])


def pixels_of(path: Path, color: str) -> int:
    """Count the pixels of a colour "#rrggbb"."""
    wanted = [int(color[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    return int(np.all(np.abs(imread(path)[..., :3] - wanted) < 0.02, axis=-1).sum())


def test_a_state_that_is_refused_is_no_estimate(tmp_path: Path) -> None:
    """One that is not finite ended the report: "braking curve speed_mps = nan"."""
    refused = serialize_message(messages.state_message(START_NS + 7 * S, math.nan, 1.0, 50.0, 1.0))
    with BagWriter(tmp_path / "bag") as writer:
        for second in range(20):
            for topic, cdr in rows(second):
                odd = topic is STATE and second == 7
                writer.write(f"/{topic.name.lstrip('/')}", topic.type, refused if odd else cdr, START_NS + second * S)
    run = read(tmp_path / "bag")
    assert run.speed.t_ns.tolist() == [START_NS + second * S for second in range(20) if second != 7]
    assert run.position.t_ns.tolist() == run.speed.t_ns.tolist()
    assert np.isfinite(distances(run, 0.0, FREE).identified).all()


def test_what_the_estimators_of_other_trains_tell_is_left_out(tmp_path: Path) -> None:
    """/diagnostics is shared; a regime of theirs at the same stamp took the place of ours."""
    with BagWriter(tmp_path / "bag") as writer:
        for second in range(20):
            for topic, cdr in rows(second):
                writer.write(f"/{topic.name.lstrip('/')}", topic.type, cdr, START_NS + second * S)
            writer.write(
                "/diagnostics", DIAGNOSTICS.type, told("train_b/estimator/adhesion", second), START_NS + second * S
            )
    run = read(tmp_path / "bag")
    assert set(run.regime.values) == {"COASTING", "ADHESION_LIMITED"}
    assert run.counts == {"regime": "ADHESION_LIMITED"}


def told(name: str, second: int) -> bytes:
    values = [KeyValue(key="regime", value="BRAKE_LIMITED"), KeyValue(key="resets", value="1")]
    status = [DiagnosticStatus(name=name, values=values)]
    return bytes(serialize_message(DiagnosticArray(header=messages.header(START_NS + second * S), status=status)))


@pytest.fixture
def recorded(tmp_path: Path) -> Run:
    return read(record(tmp_path / "bag"))


def test_the_series_are_those_of_the_recording(recorded: Run) -> None:
    times = [START_NS + second * S for second in range(20)]
    for series, value in ((recorded.true_mu, 0.1), (recorded.mu, 0.09), (recorded.mu_lower, 0.08)):
        assert series.t_ns.tolist() == times
        assert set(series.values.tolist()) == {value}
    for speeds in (recorded.speed, recorded.true_speed):
        assert speeds.values.tolist() == [80.0 - 2.0 * second for second in range(20)]
    assert recorded.true_position.values.tolist() == [80.0 * second - second**2 for second in range(20)]
    assert set(recorded.pressure.values.tolist()) == {410e3}  # gauge
    assert recorded.regime.values.tolist() == ["COASTING"] * 5 + ["ADHESION_LIMITED"] * 15


@pytest.mark.parametrize("left_out", [(), TRUTH, (BRAKE_PRESSURE,), (DIAGNOSTICS,), (*TRUTH, DIAGNOSTICS)])
def test_a_picture_is_drawn_of_what_there_is(left_out: tuple[Topic, ...], tmp_path: Path) -> None:
    path = tmp_path / "run.png"
    picture.draw(read(record(tmp_path / "bag", *left_out)), [path], "a run", 100.0)
    assert png_size(path) == (1210, 1320)
    told = DIAGNOSTICS not in left_out  # without regimes nothing is known to be identified
    assert pixels_of(path, picture.ORANGE) > (1000 if told else 500), "the curves by mu are missing"
    assert pixels_of(path, picture.BLUE) > 300, "the lower bounds are missing"
    shaded = pixels_of(path, picture.SHADES["ADHESION_LIMITED"])
    assert (shaded > 50_000) is (DIAGNOSTICS not in left_out)


def test_a_name_is_no_formula(recorded: Run, tmp_path: Path) -> None:
    picture.draw(recorded, [tmp_path / "run.png"], r"a$\frac$^{b", 0.0)
    assert png_size(tmp_path / "run.png") > (600, 600)


def test_the_truth_is_drawn_where_there_is_one(tmp_path: Path) -> None:
    black = []
    for name, left_out in (("with", ()), ("without", TRUTH)):
        path = tmp_path / f"{name}.png"
        picture.draw(read(record(tmp_path / name, *left_out)), [path], "a run", 100.0)
        black.append(pixels_of(path, picture.BLACK))
    assert black[0] > black[1] + 500


def test_what_truly_limited_stands_above_what_the_estimator_said(recorded: Run, tmp_path: Path) -> None:
    path, truth = tmp_path / "run.png", [Band(0.0, 3.0, "BRAKE_LIMITED"), Band(3.0, 19.0, "ADHESION_LIMITED")]
    picture.draw(recorded, [path], "a run", 100.0, truth=truth)
    strips = [pixels_of(path, picture.TRUE_SHADES[regime]) for regime in ("BRAKE_LIMITED", "ADHESION_LIMITED")]
    assert strips[0] > 1000
    assert strips[1] / strips[0] == pytest.approx(16.0 / 3.0, rel=0.3)


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


def test_a_single_estimate_is_drawn(tmp_path: Path) -> None:
    picture.draw(read(record(tmp_path / "bag", seconds=1)), [tmp_path / "run.png"], "short", 0.0)
    assert png_size(tmp_path / "run.png") == (1210, 1320)


def record_with_losses(path: Path, *lost: tuple[Topic, int]) -> Path:
    """Record 20 estimates, mu rising by 0.001 each second, as a live node logs them: 0.3 s after their stamps."""
    with BagWriter(path) as writer:
        for second in range(20):
            t_ns, mu = START_NS + second * S, 0.08 + 0.001 * second
            published: tuple[tuple[Topic, Any], ...] = (
                (MU, Float64(data=mu)),
                (MU_LOWER, Float64(data=mu - 0.01)),
                (DECELERATION, messages.deceleration_message(t_ns, mu, 0.001)),
                (STATE, messages.state_message(t_ns, 80.0 * second, 1.0, 80.0, 1.0)),
            )
            for at, (topic, message) in enumerate(published):
                if (topic, second) not in lost:
                    log_ns = t_ns + 3 * S // 10 + at * S // 1000
                    writer.write(f"/{topic.name}", topic.type, serialize_message(message), log_ns)
    return path


@pytest.mark.parametrize(
    "lost",
    [
        ((MU, 7),),
        ((MU_LOWER, 7),),
        ((MU, 7), (STATE, 12)),  # as many of either: by their count they would pair
        ((MU_LOWER, 7), (STATE, 12)),
        ((MU_LOWER, 7), (STATE, 12), (DECELERATION, 12)),
        ((MU, 7), (MU, 8), *((DECELERATION, second) for second in range(20))),  # recorded without the stamped form
    ],
)
def test_a_lost_message_moves_no_other_one(lost: tuple[tuple[Topic, int], ...], tmp_path: Path) -> None:
    run = read(record_with_losses(tmp_path / "bag", *lost))
    rising = {START_NS + second * S: 0.08 + 0.001 * second for second in range(20)}
    for series, less, most_missing in ((run.mu, 0.0, 2), (run.mu_lower, 0.01, 2)):
        assert series.t_ns.size >= 20 - most_missing
        assert series.values == pytest.approx([rising[t_ns] - less for t_ns in series.t_ns.tolist()], abs=1e-12)


@pytest.mark.parametrize("left_out", [(MU,), (STATE,), (MU, MU_LOWER, STATE)])
def test_without_estimates_it_says_what_to_do(left_out: tuple[Topic, ...], tmp_path: Path) -> None:
    path = record(tmp_path / "bag", *left_out)
    with pytest.raises(ValueError, match=r"bag = .*: holds no adhesion/\w+: record while the estimator runs"):
        read(path)


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


def test_a_chart_of_zeros_has_an_axis_with_different_numbers() -> None:
    zeros = Series(np.array([0, S]), np.zeros(2))
    assert Chart("Forces, kN", 1, [Line("brake B", "fixed", zeros)]).range == (0.0, 1.0)
    some = zeros.map(lambda values: values - [0.0, 5.0])
    assert Chart("saved, m", 1, [Line("by μ̂", "nominal", some)]).range == pytest.approx((-5.4, 0.0))


def test_a_train_that_stands_may_seem_to_roll_back(recorded: Run) -> None:
    """A speed has a sign; before, a picture of a train that stops was refused."""
    back = recorded._replace(speed=recorded.speed.map(np.negative))
    assert distance_to_target(back, 0.0726, 0.0, FREE) == pytest.approx(distance_to_target(recorded, 0.0726, 0.0, FREE))


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

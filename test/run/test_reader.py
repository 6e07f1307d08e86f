# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What gives the positions: a fix on a track line gives what the positions themselves give; of several one counts."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from pyproj import Geod
from test_offline import NO_TRUTH, START_NS, samples, write_run

from adhesion_node.bag import BagWriter, encode
from adhesion_node.core import Config
from adhesion_node.nodes import replay
from adhesion_node.run.offline import Recorded
from adhesion_node.run.offline import replay as replayed
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.run.reader import Reader
from adhesion_node.run.results.score import Truth
from adhesion_node.wire.line import Line
from adhesion_node.wire.messages.codec import plain
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.settings.setup import setup_of
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import ADHESION_INPUTS, BRAKE_PRESSURE, CREEP_INPUTS, FIX, ODOMETRY, POSITION, SPEED

GEOD = Geod(ellps="WGS84")
STEP_M = 50.0


@pytest.fixture(scope="module")
def way() -> list[tuple[float, float]]:
    """Longitudes and latitudes of the corners of a line through curves of 4 km and more: 10 km."""
    points, azimuth = [(8.0, 47.0)], 20.0
    for number in range(200):
        azimuth += 0.7 if number // 50 % 2 else -0.7
        longitude, latitude, _ = GEOD.fwd(*points[-1], azimuth, STEP_M)
        points.append((longitude, latitude))
    return points


@pytest.fixture(scope="module")
def track_line(way: list[tuple[float, float]], tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("line") / "line.geojson"
    path.write_text(json.dumps({"type": "LineString", "coordinates": way}), encoding="utf-8")
    return str(path)


def at(way: Sequence[tuple[float, float]], position_m: float) -> tuple[float, float]:
    """Return latitude and longitude of a chainage of the way, by geodesics."""
    corner = int(position_m // STEP_M)
    (lon, lat), (next_lon, next_lat) = way[corner : corner + 2]
    azimuth, _, _ = GEOD.inv(lon, lat, next_lon, next_lat)
    longitude, latitude, _ = GEOD.fwd(lon, lat, azimuth, position_m - corner * STEP_M)
    return latitude, longitude


def located(topic: Topic, way: Sequence[tuple[float, float]], position_m: float) -> tuple[float, ...]:
    return (*at(way, position_m), float("nan")) if topic is FIX else (position_m,)


def messages(way: Sequence[tuple[float, float]], *topics: Topic) -> Iterator[Recorded]:
    """Yield a part of tunnel_entry, its positions from some topics; chainage 0 at its first position."""
    first_m = samples()[0][1].position_m
    assert first_m is not None
    for _, reading in samples():
        t_ns = START_NS + reading.t_ns
        yield BRAKE_PRESSURE.name, BRAKE_PRESSURE.build(plain, t_ns, (reading.pressure_pa,)), t_ns
        assert reading.position_m is not None
        place_m = reading.position_m - first_m + 1000.0
        for topic in topics:
            yield topic.name, topic.build(plain, t_ns, located(topic, way, place_m), 0.25), t_ns


def run(recorded: Iterator[Recorded], **values: Any) -> Pipeline:
    setup = setup_of(values)
    pipeline = Pipeline(setup.config, setup.seed)
    replayed(pipeline, Truth(), recorded, setup.line)
    return pipeline


def test_a_fix_gives_the_adhesion_that_the_position_gives(way: list[tuple[float, float]], track_line: str) -> None:
    by_position = run(messages(way, POSITION))
    by_odometry = run(messages(way, ODOMETRY))
    by_fix = run(messages(way, FIX), track_line=track_line)
    assert by_odometry.digest == by_position.digest
    assert by_position.last is not None
    assert by_fix.last is not None
    assert (by_fix.accepted, by_fix.dropped) == (180, {})
    assert by_fix.last.mu == pytest.approx(by_position.last.mu, abs=1e-4)
    assert by_fix.last.position_m == pytest.approx(by_position.last.position_m, abs=0.01)


def test_of_several_sources_the_best_that_is_heard_counts(way: list[tuple[float, float]], track_line: str) -> None:
    alone = run(messages(way, POSITION))
    both = run(messages(way, POSITION, ODOMETRY, FIX))
    assert both.digest == alone.digest, "without a track line a fix is no source"
    assert both.dropped == {"NO_TRACK_LINE": 180, "OTHER_SOURCE": 180}
    assert both.measurements == 540
    fixed = run(messages(way, FIX, POSITION, ODOMETRY), track_line=track_line)
    assert fixed.digest == run(messages(way, FIX), track_line=track_line).digest
    named = run(messages(way, FIX, POSITION, ODOMETRY), track_line=track_line, position_source="odometry")
    assert (named.digest, named.dropped) == (alone.digest, {}), "those that are not named are not read"


def test_a_better_source_takes_over_and_is_kept() -> None:
    reader = Reader(ADHESION_INPUTS, Line())
    assert reader.anchors == (POSITION, ODOMETRY)
    position, odometry = (topic.build(plain, 10, (5.0,), 1.0) for topic in (POSITION, ODOMETRY))
    for topic, message in ((ODOMETRY, odometry), (POSITION, position)):
        assert reader.read(topic, message).t_ns == 10
        assert reader.source is topic
    with pytest.raises(
        Rejected, match=r"odometry beside position: another topic gives the positions: .* position_source"
    ):
        reader.read(ODOMETRY, odometry)


def test_a_source_that_gives_nothing_usable_does_not_count() -> None:
    reader = Reader(ADHESION_INPUTS, Line())
    with pytest.raises(Rejected, match="position x = nan"):
        reader.read(POSITION, POSITION.build(plain, 10, (float("nan"),), 1.0))
    assert reader.read(ODOMETRY, ODOMETRY.build(plain, 10, (5.0,), 1.0)) == (10, 5.0, 1.0)


def test_a_sensor_that_is_switched_off_makes_room_for_the_next_one() -> None:
    position, odometry = (topic.build(plain, 10, (5.0,), 1.0) for topic in (POSITION, ODOMETRY))
    reader = Reader(ADHESION_INPUTS, Line())
    reader.read(POSITION, position)
    reader.line = setup_of({"use_position": False}).line
    with pytest.raises(Rejected, match="use_position = false: set it to true to use this sensor") as refused:
        reader.read(POSITION, position)
    assert refused.value.reason == "SWITCHED_OFF"
    assert reader.read(ODOMETRY, odometry) == (10, 5.0, 1.0)
    reader.line = Line()
    reader.read(POSITION, position)
    assert reader.source is POSITION
    reader.line = setup_of({"use_position": False}).line
    assert reader.read(ODOMETRY, odometry) == (10, 5.0, 1.0), "though no position comes any more"


def test_stamps_that_are_late_are_put_right(way: list[tuple[float, float]]) -> None:
    """Every position of 0.3 s ago under a stamp of now, the pressures exact: the same numbers."""

    def late() -> Iterator[Recorded]:
        for name, message, t_ns in messages(way, POSITION):
            if name == POSITION.name:
                message.header = POSITION.build(plain, t_ns + 300_000_000, (0.0,), 1.0).header
            yield name, message, t_ns

    exact = run(messages(way, POSITION))
    assert run(late(), **{"latency_s.position": 0.3}).digest == exact.digest
    assert run(late()).digest != exact.digest


def test_the_creep_estimator_needs_its_wheels() -> None:
    assert Reader(CREEP_INPUTS, Line()).anchors == CREEP_INPUTS[-1:]


def test_the_offline_replay_runs_by_a_speed_alone(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for truth, reading in samples():
            t_ns = START_NS + reading.t_ns
            for topic, values in ((BRAKE_PRESSURE, (reading.pressure_pa,)), (SPEED, (truth.speed_mps,))):
                writer.write(f"/{topic.name}", topic.type, encode(topic, t_ns, values, 0.01), t_ns)
    by_doppler = ("--set", "speed_source=doppler", "--set", "iterations=5")
    assert replay.main([str(tmp_path / "bag"), "--offline", "--json", "-", *by_doppler]) == 0
    result = json.loads(capfd.readouterr().out)
    assert (result["measurements"], result["accepted"], result["dropped"]) == (0, 0, {})
    assert result["ticks"] == pytest.approx(len(samples()) * 0.1 / Config().tick_s - 1)
    assert result["windows"] > 10
    assert result["mu_final"] > 0.0


def write(path: Path, recorded: Iterator[Recorded], way: Sequence[tuple[float, float]]) -> None:
    with BagWriter(path) as writer:
        for index, (name, message, t_ns) in enumerate(recorded):
            del index
            topic = next(one for one in ADHESION_INPUTS if one.name == name)
            if topic is FIX:
                values: tuple[float, ...] = (message.latitude, message.longitude, message.altitude)
            else:
                values = (message.fluid_pressure,)
            writer.write(f"/{name}", topic.type, encode(topic, t_ns, values, 0.25), t_ns)


def test_the_offline_replay_reads_fixes(
    way: list[tuple[float, float]], track_line: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path / "bag", messages(way, FIX), way)
    assert replay.main([str(tmp_path / "bag"), "--offline", "--json", "-", "--set", f"track_line={track_line}"]) == 0
    result = json.loads(capfd.readouterr().out)
    assert Counter(result["dropped"]) == Counter()
    assert result["digest"] == run(messages(way, FIX), track_line=track_line).digest
    assert replay.main([str(tmp_path / "bag"), "--offline"]) == 2
    needed = "position or odometry or speed or wheel_speed, without which nothing is identified"
    assert f"holds no {needed}; a fix needs track_line" in capfd.readouterr().err


def test_a_bag_of_another_way_says_what_is_wrong(
    way: list[tuple[float, float]], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "other.csv").write_text("lat,lon\n48,9\n48.1,9\n", encoding="utf-8")
    write(tmp_path / "bag", messages(way, FIX), way)
    options = ["--offline", "--json", "-", "--set", f"track_line={tmp_path / 'other.csv'}"]
    assert replay.main([str(tmp_path / "bag"), *options]) == 1
    assert json.loads(capfd.readouterr().out)["dropped"] == {"OFF_TRACK": 180}


def test_positions_of_a_bag_are_read_as_ever(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write_run(tmp_path / "bag", samples()[:60], names=NO_TRUTH)
    assert replay.main([str(tmp_path / "bag"), "--offline", "--json", "-", "--set", "position_source=odometry"]) == 2
    assert "holds no odometry" in capfd.readouterr().err

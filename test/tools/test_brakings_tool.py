# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`brakings`: one table of the brakings of many recordings, a map of the rail, and what could not be used."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest
import test_offline
from recorded import JSON, write_beside
from tasks import computed_here
from test_import_log import ride, text
from test_offline import NO_TRUTH, samples, write_run

from adhesion_node.nodes import replay
from adhesion_node.run.results.rail_map import map_of
from adhesion_node.tools import import_csv
from adhesion_node.tools.brakings import __main__ as brakings
from adhesion_node.tools.log.format import Format
from adhesion_node.wire.topics import BRAKE_PRESSURE


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a braking twice, and something that is no recording."""
    folder = tmp_path_factory.mktemp("bags")
    write_run(folder / "monday", samples(15.0, 30.0), names=NO_TRUTH)
    write_run(folder / "tuesday", samples(15.0, 26.0), names=NO_TRUTH)
    (folder / "broken.mcap").write_bytes(b"nothing")
    return folder


@pytest.fixture
def here() -> Iterator[None]:
    """Compute in this process: that other ones can do it is shown by the first test below."""
    with computed_here():
        yield


def test_all_brakings_are_one_table_whatever_a_single_recording_is_worth(
    bags: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    table, rail, result = tmp_path / "brakings.parquet", tmp_path / "rail.csv", tmp_path / "result.json"
    named = [f"unit_7={bags / 'monday'}", str(bags / "tuesday"), str(bags / "broken.mcap")]
    options = ["--output", str(table), "--map", str(rail), "--cache", str(tmp_path / "cache"), "--cell", "200"]
    assert brakings.main([*named, *options, "--json", str(result), "--train", "high_speed"]) == 1
    out, err = capfd.readouterr()
    assert f"brakings: {bags / 'broken.mcap'}: " in err
    found = pd.read_parquet(table)
    assert list(found["train"]) == ["unit_7", "tuesday"]
    assert list(found["recording"]) == [str(bags / "monday"), str(bags / "tuesday")]
    assert (found["from_kmh"] > 290).all()
    assert found["to_kmh"].is_monotonic_increasing
    assert str(found["time"].dt.tz) == "UTC"
    assert (found["time"].dt.year == 2023).all()
    told = json.loads(result.read_text(encoding="utf-8"))
    assert (told["recordings"], told["brakings"], list(told["failed"])) == (2, 2, [str(bags / "broken.mcap")])
    assert told["train"].startswith("high-speed multiple unit (CRH3)")
    assert "high-speed multiple unit" in out
    pieces = pd.read_csv(rail)
    assert (pieces["place_m"] % 200 == 0).all()
    assert set(pieces["seen"]) <= {1, 2}
    assert (pieces["mu_lower"] > 0.0).all()


@pytest.mark.usefixtures("here")
def test_what_is_finished_is_kept(bags: Path, tmp_path: Path) -> None:
    options = ["--output", str(tmp_path / "brakings.csv"), "--cache", str(tmp_path / "cache")]
    assert brakings.main([str(bags / "monday"), *options]) == 0
    first = (tmp_path / "brakings.csv").read_bytes()
    (kept,) = (tmp_path / "cache").iterdir()
    written = kept.stat().st_mtime_ns
    assert brakings.main([str(bags / "monday"), *options]) == 0
    assert ((tmp_path / "brakings.csv").read_bytes(), kept.stat().st_mtime_ns) == (first, written)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("copied", [False, True])
def test_a_braking_counts_once_however_often_it_is_given(
    copied: bool, bags: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    monday, tuesday, again = bags / "monday", bags / "tuesday", tmp_path / "again"
    if copied:
        shutil.copytree(monday, again)
    else:
        again.symlink_to(monday, target_is_directory=True)
    table, rail = tmp_path / "brakings.csv", tmp_path / "rail.csv"
    options = ["--output", str(table), "--map", str(rail), "--cache", str(tmp_path / "cache")]
    assert brakings.main([str(monday), str(tuesday), *options]) == 0
    once = table.read_bytes(), rail.read_bytes()
    assert told(capfd) == []
    assert brakings.main([str(monday), str(again), str(tuesday), *options]) == 0
    assert (table.read_bytes(), rail.read_bytes()) == once
    said = {
        True: f"brakings: {again}: brakings that are in {monday}, too: 1; each counts once: give them once",
        False: f"brakings: {monday}: is given 2 times, and counts once, as of train monday: give it once",
    }
    assert told(capfd) == [said[copied]]


def told(capfd: pytest.CaptureFixture[str]) -> list[str]:
    """What is said on standard error, but for the bar of progress, which a slow machine shows."""
    return [line for line in capfd.readouterr().err.splitlines() if line.startswith("brakings: ")]


@pytest.mark.usefixtures("here")
def test_what_is_left_out_of_a_recording_is_said_as_replay_says_it(
    bags: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """It was passed over."""
    renamed, cut, beside = (tmp_path / name for name in ("renamed", "cut.mcap", "beside.mcap"))
    write_run(renamed, samples(15.0, 30.0), names={**NO_TRUTH, BRAKE_PRESSURE: "/brakes/cylinder"})
    (whole,) = (bags / "monday").glob("*.mcap")
    cut.write_bytes(whole.read_bytes()[:-20_000])
    write_beside(beside, JSON, steps=100)
    replayed = []
    for bag in (renamed, cut, beside):
        replay.main([str(bag), "--offline"])
        lines = [line for line in capfd.readouterr().err.splitlines() if line.startswith("replay: ")]
        lines = [line.removeprefix("replay: ") for line in lines if "nothing is identified" not in line]
        replayed += [f"brakings: {bag}: {line}" for line in lines]
    options = ["--output", str(tmp_path / "brakings.csv"), "--cache", str(tmp_path / "cache")]
    brakings.main([str(renamed), str(cut), str(beside), *options])
    said = told(capfd)
    assert said == replayed
    for line, what in zip(
        said, ("no brake_pressure is read", "breaks off at byte", "topic /log: encoding"), strict=True
    ):
        assert what in line


@pytest.mark.usefixtures("here")
def test_why_nothing_comes_of_a_recording_is_said(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Nothing was dropped, and no topic would have been right."""
    short, empty = tmp_path / "short", tmp_path / "empty"
    write_run(short, samples()[:1], names=NO_TRUTH)
    write_run(empty, [])
    options = ["--output", str(tmp_path / "brakings.csv"), "--cache", str(tmp_path / "cache")]
    assert brakings.main([str(short), str(empty), *options]) == 1
    assert told(capfd) == [
        f"brakings: {short}: nothing to estimate from; dropped: nothing, it is too short",
        f"brakings: {empty}: bag = {empty}: holds no message: name another recording",
    ]


@pytest.mark.usefixtures("here")
def test_stamps_without_a_date_are_said_of_a_map(
    bags: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(test_offline, "START_NS", 0)
    write_run(tmp_path / "undated", samples(15.0, 30.0), names=NO_TRUTH)
    table, rail = str(tmp_path / "brakings.csv"), str(tmp_path / "rail.csv")
    options = ["--output", table, "--cache", str(tmp_path / "cache")]
    assert brakings.main([str(tmp_path / "undated"), str(bags / "monday"), *options, "--map", rail]) == 0
    (line,) = told(capfd)
    assert line.startswith(f"brakings: {tmp_path / 'undated'}: stamps of 1970")
    assert line.endswith(": stamp them in UTC, or import logs with dates")
    assert brakings.main([str(tmp_path / "undated"), *options]) == 0
    assert told(capfd) == [], "a table tells no age"


@pytest.mark.usefixtures("here")
def test_a_recording_without_positions_is_in_the_table_alone(
    bags: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """By its speed alone a place is the way from where the recording begins: no place of the line."""
    log, speeds, rail = tmp_path / "log.csv", tmp_path / "speeds", tmp_path / "rail.csv"
    rows = ride(80).assign(time=ride(80).time + 1.7e9)
    log.write_text(text(rows.drop(columns="position")))
    import_csv.convert(log, speeds, Format(named={}))
    options = ["--output", str(tmp_path / "brakings.csv"), "--map", str(rail), "--cache", str(tmp_path / "cache")]
    assert brakings.main([str(bags / "monday"), *options]) == 0
    placed = pd.read_csv(rail)
    for more in ([str(bags / "monday")], []):
        assert told(capfd) == []
        assert brakings.main([str(speeds), *more, *options]) == 0
        (line,) = told(capfd)
        assert line.startswith(f"brakings: {speeds}: has no positions, its places count from its beginning: left out")
        assert str(speeds) in set(pd.read_csv(tmp_path / "brakings.csv")["recording"])
        pd.testing.assert_frame_equal(pd.read_csv(rail), placed if more else placed[:0], check_dtype=False)


@pytest.mark.parametrize("other", ["--map", "--json"])
@pytest.mark.parametrize("path", ["table.csv", "./table.csv", "link.csv"])
def test_no_file_takes_the_place_of_the_table(
    other: str,
    path: str,
    bags: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("link.csv").symlink_to("table.csv")
    assert brakings.main([str(bags / "monday"), "--output", "table.csv", other, path, "--cache", "cache"]) == 2
    said = f"brakings: --output table.csv and {other} {path}: both are one file: give each its own"
    assert capfd.readouterr().err.splitlines() == [said]
    assert not Path("table.csv").exists()
    assert not Path("cache").exists(), "nothing is replayed"


@pytest.mark.usefixtures("here")
def test_a_name_of_bytes_that_are_no_text_is_escaped(bags: Path, tmp_path: Path) -> None:
    named, table = tmp_path / os.fsdecode(b"t\xff"), tmp_path / "brakings.csv"
    named.symlink_to(bags / "monday", target_is_directory=True)
    assert brakings.main([str(named), "--output", str(table), "--cache", str(tmp_path / "cache")]) == 0
    assert list(pd.read_csv(table)["recording"]) == [str(tmp_path / "t\\udcff")]


def test_the_map_says_how_often_where_and_when() -> None:
    day = 86_400 * 10**9
    cells = pd.DataFrame(
        {
            "cell": [3, 3, 3, 4],
            "t_ns": [0, 10**9, day, 0],
            "limited": [True, True, True, False],
            "speed_mps": 30.0,
            "mu": [0.05, 0.07, 0.10, float("nan")],
            "mu_std": [0.003, 0.003, 0.004, float("nan")],
            "used": [0.05, 0.07, 0.10, 0.08],
            "mu_lower": [0.045, 0.065, 0.09, 0.075],
        }
    )
    rail = map_of(cells, 100.0).set_index(["place_m", "date"])
    first = rail.loc[(300.0, "1970-01-01")]
    assert (first["seen"], first["limited"], first["mu_lowest"], first["mu_lower"]) == (2, 2, 0.05, 0.045)
    assert first["mu"] == pytest.approx(0.06)
    assert first["mu_std"] == pytest.approx((0.003**2 + 2 * 0.01**2) ** 0.5)
    assert rail.loc[(300.0, "1970-01-02"), "mu"] == pytest.approx(0.10)
    only_brake = rail.loc[(400.0, "1970-01-01")]
    assert (only_brake["limited"], only_brake["mu_lower"]) == (0, 0.075)
    assert pd.isna(only_brake["mu"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--output", "brakings.xlsx"], "output = brakings.xlsx: give a file that ends in .csv or .parquet"),
        (["--output", "b.csv", "--map", "m.txt"], "map = m.txt: give a file that ends in .csv or .parquet"),
        (["--output", "b.csv", "--cell", "100"], "--cell 100.0: there is no map without --map: add that, or leave"),
        (
            ["--output", "b.csv", "--workers", "2", "--scheduler", "tcp://a:1"],
            "--workers 2: the cluster of --scheduler has its own: leave the one or the other out",
        ),
        (["--output", "b.csv", "--map", "m.csv", "--cell", "0"], "cell = 0.0: give a length of 1 to 100000 m"),
        (["--output", "b.csv", "--workers", "0"], "workers = 0: give at least 1"),
        (["--output", "b.csv", "--set", "start_mu=2"], "start_mu = 2.0: give a value from 0 to 1"),
    ],
)
def test_bad_usage_is_said_before_anything_is_replayed(
    options: list[str], said: str, bags: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert brakings.main([str(bags / "monday"), *options]) == 2
    assert said in capfd.readouterr().err
    for given, path in (("nowhere", "nowhere"), ("ice=a=b/c", "a=b/c"), ("ice=", "ice=")):
        assert brakings.main([given, "--output", "b.csv"]) == 2
        assert f"bag = {path}: is not there" in capfd.readouterr().err

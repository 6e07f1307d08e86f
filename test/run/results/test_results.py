# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`replay --offline --out`: every estimate as a row of a CSV or Parquet file, written as it comes."""

from __future__ import annotations

import csv
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest
from recorded import write_steps
from test_offline import NO_TRUTH, START_NS, samples, write_run

from adhesion_node.bag import BagReader, select_from
from adhesion_node.core import Config
from adhesion_node.nodes import replay
from adhesion_node.run import offline
from adhesion_node.run.offline import Recorded
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.run.results.rows import COLUMNS, LEARNT, rows_to
from adhesion_node.wire.line import NOMINAL


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record 18 s of a train without the truth: a full brake from the fifth second on."""
    path = tmp_path_factory.mktemp("bag") / "run"
    write_run(path, samples(), names=NO_TRUTH)
    return path


def rows_of(bag: Path, out: Path, *options: str) -> list[dict[str, str]]:
    assert replay.main([str(bag), "--offline", "--out", str(out), *options]) == 0
    with out.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_estimate_is_a_row_of_numbers_as_they_were_published(bag: Path, tmp_path: Path) -> None:
    rows = rows_of(bag, tmp_path / "results.csv")
    with BagReader(bag) as reader:
        recorded = offline.messages(reader, select_from(reader, []), NOMINAL)
        pipeline = Pipeline(Config(), 1)
        made = list(offline.predictions(pipeline, None, recorded, NOMINAL, array("d")))
    assert list(rows[0]) == list(COLUMNS)
    assert len(rows) == len(made) > 30
    for row, prediction in zip(rows, made, strict=True):
        estimate = prediction.estimate
        assert (int(row["t_ns"]), row["regime"]) == (estimate.t_ns, estimate.regime.name)
        assert [float(row[name]) for name in ("position_m", "speed_mps", "mu", "mu_std", "mu_lower")] == [
            *(estimate.position_m, estimate.speed_mps, estimate.mu, estimate.mu_std, estimate.mu_lower)
        ]
        assert prediction.safe is not None
        assert float(row["safe_m"]) == prediction.safe.distance_m[-1]
    last = rows[-1]
    assert START_NS < int(last["t_ns"]) < START_NS + 34 * 10**9
    assert 0.0 < float(last["mu_lower"]) < float(last["mu"])
    assert float(last["nominal_m"]) < float(last["safe_m"])
    assert int(rows[0]["braking"]) == 0 < int(last["braking"])
    assert all(last[name] for name in LEARNT)
    assert 0.5 < float(last["brake_factor"]) < 1.5


def test_parquet_holds_the_same_with_types(bag: Path, tmp_path: Path) -> None:
    texts = rows_of(bag, tmp_path / "results.csv")
    assert replay.main([str(bag), "--offline", "--out", str(tmp_path / "results.parquet")]) == 0
    rows: list[dict[str, Any]] = pyarrow.parquet.read_table(tmp_path / "results.parquet").to_pylist()
    assert [{name: str(value) for name, value in row.items()} for row in rows] == texts


def test_a_method_of_windows_leaves_empty_what_it_does_not_learn(bag: Path, tmp_path: Path) -> None:
    rows = rows_of(bag, tmp_path / "results.csv", "--set", "method=rail_condition")
    assert {row[name] for row in rows for name in LEARNT} == {""}
    assert all(float(row["mu"]) > 0.0 for row in rows)


def test_estimates_come_while_the_recording_is_read(bag: Path) -> None:
    read = 0

    def counted(recorded: Iterator[Recorded]) -> Iterator[Recorded]:
        nonlocal read
        for message in recorded:
            read += 1
            yield message

    with BagReader(bag) as reader:
        stream = counted(offline.messages(reader, select_from(reader, []), NOMINAL))
        made = offline.predictions(Pipeline(Config(), 1), None, stream, NOMINAL, array("d"))
        next(made)
        early = read
        assert len(list(made)) > 30
    assert early < 0.1 * read, "a day is to take no more memory than an hour"


@pytest.mark.parametrize(
    ("out", "options", "said"),
    [
        ("results.txt", [], "results.txt: give a file that ends in .csv or .parquet"),
        ("nowhere/results.csv", [], "nowhere/results.csv: No such file or directory: name one that is there, or make"),
        (
            "results.csv",
            ["--estimator", "creep"],
            "results.csv: rows are there of the adhesion alone, not of the creep curve: leave",
        ),
    ],
)
def test_what_cannot_be_written_is_said_before_anything_is_replayed(
    out: str, options: list[str], said: str, bag: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert replay.main([str(bag), "--offline", "--out", str(tmp_path / out), *options]) in (1, 2)
    error = capfd.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_without_offline_there_are_no_rows(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write_steps(tmp_path / "run", 3)
    assert replay.main([str(tmp_path / "run"), "--out", "results.csv"]) == 2
    assert "--out results.csv: is for --offline" in capfd.readouterr().err


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("rows", [0, 1, 10_000])
def test_a_full_disk_names_the_file(tmp_path: Path, ending: str, rows: int) -> None:
    """Whenever it shows: the last rows wait until the file is closed."""
    path = tmp_path / f"results.{ending}"
    path.symlink_to("/dev/full")

    def write_all() -> None:
        with rows_to(str(path)) as write:
            for row in range(rows):
                write({"t_ns": row, "regime": "COASTING"})

    with pytest.raises(OSError, match="No space left") as raised:
        write_all()
    assert raised.value.filename == str(path)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Replays many recordings on all cores; writes a table of all their brakings, and a map of the rail by place and date.

A recording that cannot be used is said and left out. A braking counts once, however often it is given or copied. What
is finished is kept, so that a killed call goes on.
"""

import argparse
import os
import sys
from array import array
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..bag import BagReader, select_from
from ..command.checks import refuse
from ..command.options import (
    DONE,
    FAILED,
    help_texts,
    json_option,
    printable,
    remap_option,
    report,
    run_tool,
    setting_options,
)
from ..command.running import Arrays, add_running_options, run_all, running
from ..command.written import naming
from ..run import offline
from ..run.pipeline import Pipeline
from ..run.results.brakings import BRAKING, CELL, CELL_M, brakings
from ..run.results.rail_map import map_of
from ..wire.files.train import read_train
from ..wire.settings.nodes import TRAIN_FILE
from ..wire.settings.setup import setup_of

EXAMPLES = (
    "brakings monday tuesday --output brakings.parquet --map rail.parquet",
    "brakings unit_7=runs/4711 unit_8=runs/4712 --train my_train.yaml --output brakings.csv",
    "brakings runs/* --output brakings.parquet --scheduler tcp://head:8786",
)

ENDINGS = (".csv", ".parquet")

MB = 1e6


class Recording(NamedTuple):
    """A recording with the settings by which it is replayed: a task."""

    train: str
    path: str
    as_of: tuple[tuple[int, int], ...]
    """Bytes and time of change, of it and of the files that the settings name: other contents are another task."""
    settings: tuple[tuple[str, Any], ...]
    remaps: tuple[str, ...]
    namespace: str | None
    cell_m: float

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"brakings-{Path(self.path).resolve().stem}"

    @property
    def weight(self) -> float:
        """How much work it is: its size, MB."""
        return max(self.as_of[0][0] / MB, 1e-3)

    def compute(self) -> Arrays:
        """Replay it; what is wrong with it is a result, too."""
        try:
            rows, cells, placed = self._replay()
        except (OSError, ValueError) as error:
            return {"failed": np.array(str(error))}
        return {"rows": rows, "cells": cells, "placed": np.array(placed), "failed": np.array("")}

    def _replay(self) -> tuple[NDArray[np.void], NDArray[np.void], bool]:
        """Its brakings, the pieces of track of those, and whether these are known: by a speed alone they are not."""
        setup = setup_of(dict(self.settings))
        with BagReader(Path(self.path)) as reader:
            recorded = offline.messages(reader, select_from(reader, self.remaps, namespace=self.namespace), setup.line)
            pipeline = Pipeline(setup.config, setup.seed)
            made = offline.predictions(pipeline, None, recorded, setup.line, array("d"))
            found = list(brakings(made, self.cell_m, setup.line.sign))
        if pipeline.last is None:
            raise ValueError(f"nothing to estimate from; dropped: {pipeline.dropped or 'nothing'}")
        rows = np.concatenate([np.empty(0, BRAKING), *(one.row for one in found)])
        cells = [one.cells for one in found if pipeline.accepted]
        return rows, np.concatenate([np.empty(0, CELL), *cells]), pipeline.accepted > 0


def main(args: Sequence[str] | None = None) -> int:
    """Run `brakings BAG... --output FILE`."""
    parser = argparse.ArgumentParser("brakings", parents=[json_option()], **help_texts(__doc__ or "", *EXAMPLES))
    add = parser.add_argument
    add("bags", metavar="[TRAIN=]BAG", nargs="+", help="recordings, each with the name of its train, or under its own")
    add("--output", metavar="FILE", required=True, help="the table of all brakings, .parquet or .csv")
    add("--map", metavar="FILE", help="the rail by place and date, .parquet or .csv")
    add("--cell", metavar="M", type=float, help=f"length of a piece of track of the map (default: {CELL_M:g})")
    remap_option(add)
    add_running_options(parser)
    setting_options(parser.add_argument_group("the estimator").add_argument)
    return run_tool(parser, _work, args)


def _work(options: argparse.Namespace) -> int:
    _check_files(options)
    if not options.map:
        refuse(options, ["cell"], "there is no map without --map: add that, or leave this out")
    options.cell = CELL_M if options.cell is None else options.cell
    if not 1.0 <= options.cell <= 1e5:
        raise ValueError(f"cell = {options.cell}: give a length of 1 to 100000 m")
    values = offline.parameters_of(options)
    setup = setup_of(values)
    for remark in setup.unread:
        print(f"brakings: {remark}", file=sys.stderr)
    if values.get(TRAIN_FILE.name):  # by its contents, which may change under its name
        values = {**read_train(values.pop(TRAIN_FILE.name)).values, **values}
    tasks = _once([_recording(text, values, options) for text in options.bags])
    failed, rows, cells = dict[str, str](), [], []
    for task, found in zip(tasks, run_all(tasks, running(options)), strict=True):
        if str(found["failed"]):
            failed[task.path] = str(found["failed"])
            print(f"brakings: {task.path}: {failed[task.path]}", file=sys.stderr)
            continue
        rows.append(pd.DataFrame(found["rows"]).assign(train=printable(task.train), recording=printable(task.path)))
        cells.append(pd.DataFrame(found["cells"]))
        if options.map and not found["placed"]:
            where = "has no positions, its places count from its beginning: left out of the map"
            print(f"brakings: {task.path}: {where}: record positions, or set track_line for its fixes", file=sys.stderr)
    result: dict[str, Any] = {"train": setup.train, "recordings": len(rows), "failed": failed, "brakings": 0}
    if rows:
        table = table_of(_without_copies(pd.concat(rows)))
        _write(table, options.output)
        result |= {"brakings": len(table), "output": options.output, **_summary(table)}
    if rows and options.map:
        _say_undated(table)
        rail = map_of(pd.concat(cells).drop_duplicates(), options.cell)
        _write(rail, options.map)
        result |= {"map": options.map, "pieces": int(rail["place_m"].nunique())}
    report(options.json, result, "\n".join(f"{name:<28} {value}" for name, value in result.items()))
    return FAILED if failed or not rows else DONE


def table_of(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per braking, in the order of time."""
    table = rows.sort_values("t_ns", ignore_index=True)
    table.insert(0, "time", pd.to_datetime(table["t_ns"], utc=True))
    return table[["train", "recording", *table.columns.drop(["train", "recording"])]]


def _check_files(options: argparse.Namespace) -> None:
    """Raise ValueError for a file that cannot be written as it is named, or that would take another's place."""
    for name, path in (("output", options.output), ("map", options.map)):
        if path and Path(path).suffix not in ENDINGS:
            raise ValueError(f"{name} = {path}: give a file that ends in {' or '.join(ENDINGS)}")
    named = [(name, path) for name in ("output", "map", "json") if (path := getattr(options, name))]
    for (one, path), (other, again) in combinations(named, 2):
        if os.path.realpath(path) == os.path.realpath(again):
            raise ValueError(f"--{one} {path} and --{other} {again}: both are one file: give each its own")


def _once(tasks: Sequence[Recording]) -> list[Recording]:
    """Say which recordings are given more than once, as by overlapping patterns, and take the first of each."""
    by_place = dict[str, list[Recording]]()
    for task in tasks:
        by_place.setdefault(os.path.realpath(task.path), []).append(task)
    for first, *more in by_place.values():
        if more:
            counted = f"is given {1 + len(more)} times, and counts once, as of train {first.train}"
            print(f"brakings: {first.path}: {counted}: give it once", file=sys.stderr)
    return [first for first, *_ in by_place.values()]


def _without_copies(rows: pd.DataFrame) -> pd.DataFrame:
    """Say which brakings are copies, and take the first of each: no two agree in their stamps and in every number."""
    numbers = list(BRAKING.names or ())
    copied = rows.duplicated(numbers)
    first = rows.groupby(numbers, dropna=False)["recording"].transform("first")
    for (path, of), count in rows.assign(of=first)[copied].groupby(["recording", "of"]).size().items():
        shared = f"{count} of its brakings are those of {of}, and count once"
        print(f"brakings: {path}: {shared}: give one of both", file=sys.stderr)
    return rows[~copied]


def _say_undated(table: pd.DataFrame) -> None:
    """A date of 1970 is that of a clock which began at 0."""
    undated = table["recording"][table["time"].dt.year == 1970].unique()
    if undated.size:
        what = "stamps of 1970, as of a clock that began at 0, tell no date, and the map no age"
        print(f"brakings: {', '.join(undated)}: {what}: stamp them in UTC, or import logs with dates", file=sys.stderr)


def _recording(text: str, values: dict[str, Any], options: argparse.Namespace) -> Recording:
    name, _, path = ("", "", text) if Path(text).exists() else text.rpartition("=")
    if not Path(path).exists():
        raise ValueError(f"bag = {path}: is not there")
    named = [value for value in values.values() if isinstance(value, str) and value and Path(value).is_file()]
    as_of = tuple(_as_of(Path(each)) for each in (path, *named))
    train = name or Path(path).resolve().stem
    settings, remaps = tuple(sorted(values.items())), tuple(options.remap)
    return Recording(train, path, as_of, settings, remaps, options.namespace, options.cell)


def _as_of(path: Path) -> tuple[int, int]:
    """Bytes of a file, or of a folder's files, and when they were last changed, ns."""
    files = [file for file in (path.rglob("*") if path.is_dir() else [path]) if file.is_file()]
    return sum(file.stat().st_size for file in files), max((file.stat().st_mtime_ns for file in files), default=0)


def _summary(table: pd.DataFrame) -> dict[str, Any]:
    """What a person looks at first: how many brakings showed the adhesion, and the lowest of all."""
    limited = table[table["mu"].notna()]
    if limited.empty:
        return {"limited": 0, "lowest_mu": None}
    lowest = limited.loc[limited["mu_least"].idxmin()]
    return {
        "limited": len(limited),
        "lowest_mu": float(lowest["mu_least"]),
        "lowest_at": f"{lowest['place_m']:.0f} to {lowest['place_end_m']:.0f} m, {lowest['time']:%Y-%m-%d %H:%M}",
    }


def _write(frame: pd.DataFrame, path: str) -> None:
    if Path(path).suffix == ".csv":
        with naming(path):
            frame.to_csv(path, index=False)
        return
    try:
        with naming(path):
            frame.to_parquet(path, index=False)
    except ImportError as error:
        raise ValueError(f"output = {path}: needs pyarrow, pip install '.[parquet]', or write a .csv") from error

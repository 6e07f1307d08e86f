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
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from ...command.checks import refuse
from ...command.options import (
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
from ...command.running import add_running_options, run_all, running
from ...command.written import require_folder
from ...run import offline
from ...run.results.brakings import CELL_M
from ...run.results.copies import without_copies
from ...run.results.rail_map import map_of
from ...wire.files.train import read_train
from ...wire.settings.nodes import TRAIN_FILE
from ...wire.settings.setup import setup_of
from .recording import once, recording_of
from .table import say_undated, summary, table_of, write

EXAMPLES = (
    "brakings monday tuesday --output brakings.parquet --map rail.parquet",
    "brakings unit_7=runs/4711 unit_8=runs/4712 --train my_train.yaml --output brakings.csv",
    "brakings runs/* --output brakings.parquet --scheduler tcp://head:8786",
)

ENDINGS = (".csv", ".parquet")


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
    tasks = once([recording_of(text, values, options) for text in options.bags])
    failed, rows, cells = dict[str, str](), [], []
    for task, found in zip(tasks, run_all(tasks, running(options)), strict=True):
        for remark in found["told"]:
            print(f"brakings: {task.path}: {remark}", file=sys.stderr)
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
        once_each, copies = without_copies(pd.concat(rows))
        for remark in copies:
            print(f"brakings: {remark}", file=sys.stderr)
        table = table_of(once_each)
        write(table, options.output)
        result |= {"brakings": len(table), "output": options.output, **summary(table)}
    if rows and options.map:
        say_undated(table)
        rail = map_of(pd.concat(cells).drop_duplicates(), options.cell)
        write(rail, options.map)
        result |= {"map": options.map, "pieces": int(rail["place_m"].nunique())}
    report(options.json, result, "\n".join(f"{name:<28} {value}" for name, value in result.items()))
    return FAILED if failed or not rows else DONE


def _check_files(options: argparse.Namespace) -> None:
    """Raise for a table that cannot be written as it is named: ValueError by its ending, OSError by its folder."""
    for name, path in (("output", options.output), ("map", options.map)):
        if path and Path(path).suffix not in ENDINGS:
            raise ValueError(f"{name} = {path}: give a file that ends in {' or '.join(ENDINGS)}")
        if path:
            require_folder(path, None)


if __name__ == "__main__":
    raise SystemExit(main())

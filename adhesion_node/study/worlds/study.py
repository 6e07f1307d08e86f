# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study worlds`: the estimator on trains, rails, brakings and sensors that are drawn at random.

World r of a line has seed FIRST_SEED + r: a train of 25 to 400 m, a rail of 0.025 to 0.3 that is even, rises or falls,
a protection that lets axles creep little or much, up to three partial brakings before the full one, sensors of any
quality; the seed's train is that of all lines. What the columns say is in doc/real_train.md; *short* are the worlds in
which less than 99 % of the safe curves are long enough, *over* those in which less than 95 % of the bounds hold.
"""

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from sim_node.real.drawn import SENSORS

from ...command.checks import at_least
from ...command.running import add_running_options, running
from ...core import Config
from ...core.readers import unread
from ...core.setting import settings_of
from ...wire.settings.given import parse_setting
from ..real.goals import OF_ALL
from ..real.score import of_run, score
from ..real.trials import Found
from ..trial.text import Column, lines
from .trials import Kind, found

FIRST_SEED = 1000

CONFIDENCE = "curve_confidence"

LEAST = {goal.figure: goal.least for goal in OF_ALL}

SHOWN = (
    ("error %", 8, ".1f", "error_percent", 1.0),
    ("cover %", 8, ".1f", "coverage95", 100.0),
    ("bound %", 8, ".1f", "bound_kept", 100.0),
    ("worst", 6, ".1f", "bound_kept_worst", 100.0),
    ("over", 5, "d", "bound_kept_missed", 1),
    ("safe %", 7, ".2f", "safe", 100.0),
    ("worst", 6, ".1f", "safe_worst", 100.0),
    ("short", 6, "d", "safe_missed", 1),
    ("excess %", 9, ".0f", "excess_percent", 1.0),
    ("regime %", 9, ".1f", "regime_wrong", 100.0),
    ("3 std %", 8, ".1f", "speed_beyond_3_std", 100.0),
    ("silence", 8, ".1f", "silence_s", 1.0),
    ("withheld %", 11, ".1f", "withheld", 100.0),
)
"""Head, width, format, figure and factor of every column."""


def _scaled(figure: str, factor: float, row: Mapping[str, Any]) -> Any:
    return None if row[figure] is None else factor * row[figure]


COLUMNS = (
    Column("sensors", 38, "", "sensors"),
    Column("worlds", 7, "d", "runs"),
    *(Column(head, width, form, partial(_scaled, figure, factor)) for head, width, form, figure, factor in SHOWN),
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study worlds`."""
    parser.add_argument("--runs", type=int, default=20, help="worlds of each line")
    parser.add_argument("--only", default="", metavar="TEXT,...", help="lines whose sensors hold one of the texts")
    levels = "confidences of the safe curve, separated by commas: all worlds are run by each"
    parser.add_argument("--curve-confidence", default="0.99", metavar="P,...", help=levels)
    other = "a setting of the estimator that shall differ from what it is told else; repeatable"
    parser.add_argument("--set", metavar="NAME=VALUE", action="append", default=[], help=other)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, metavar="SEED", help="of the first world")
    add_running_options(parser)


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Run what is missing, return a row for each line and confidence."""
    at_least(options, runs=1, first_seed=0)
    own = settings_of(Config)
    told = [parse_setting(text, own) for text in options.set]
    asked = [parse_setting(f"{CONFIDENCE}={text}", own) for text in options.curve_confidence.split(",")]
    for remark in unread(dict(told), own):
        print(f"study: {remark}", file=sys.stderr)
    for one in asked:
        Config(**dict[str, Any]([*told, one]))  # what is out of its range is refused before hours of work
    kinds = [Kind(sensors, (*told, one)) for one in asked for sensors in _chosen(options.only)]
    table = [
        _row(kind, of_kind)
        for kind, of_kind in zip(kinds, found(kinds, options.first_seed, options.runs, running(options)), strict=True)
    ]
    return table, "\n".join(_text(table))


def _chosen(only: str) -> list[str]:
    wanted = [text.strip() for text in only.split(",") if text.strip()]
    some = [sensors for sensors in SENSORS if not wanted or any(text in sensors for text in wanted)]
    if not some:
        raise ValueError(f"only = {only}: give parts of {'; '.join(SENSORS)}")
    return some


def _row(kind: Kind, of_kind: Found) -> dict[str, Any]:
    """The figures of a line, and in how many worlds it misses a goal."""
    of_worlds = [of_run(of_kind.of_seed(seed)) for seed in of_kind.runs["seed"]]
    missed = {
        f"{figure}_missed": sum(value is not None and value < LEAST[figure] for value in values)
        for figure in ("bound_kept", "safe")
        for values in [[world[figure] for world in of_worlds]]
    }
    return {"sensors": kind.sensors, **dict(kind.told), **score(of_kind), **missed}


def _text(table: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """The lines, by the confidence of the curve, and how often it is long enough in the mean of all of them."""
    levels = dict[float, list[Mapping[str, Any]]]()
    for row in table:
        levels.setdefault(row[CONFIDENCE], []).append(row)
    for asked, rows in levels.items():
        kept = 100.0 * np.mean([row["safe"] for row in rows if row["safe"] is not None])
        yield f"safe curves of {asked:.4g}: {kept:.2f} % are long enough"
        yield from lines(COLUMNS, rows)
        yield ""

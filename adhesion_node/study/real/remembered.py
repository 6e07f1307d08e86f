# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a map of the rail is worth: the safe curve at the first second of braking with and without it.

Earlier trains leave a map of the line an hour before; others come then, on the same kind of rail or on another, of
which the map knows nothing. Trains, rails and sensors differ by their seeds, as on the second plant.
"""

import argparse
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from sim_node.real.drive import START_S, Drive

from ...command.checks import at_least
from ...command.running import Arrays, add_running_options, run_all, running
from ...core import Config
from ...core.belief.rail_map import RailMap
from ...core.physics.train import Array
from ...run.pipeline import Pipeline
from ...run.results.brakings import CELL_M, brakings
from ...run.results.rail_map import map_of
from ...wire.files.rail_map import map_of_rows
from ..trial.estimators import through
from ..trial.text import Column, lines
from ..trial.trials import length_m
from ..trial.world import Sent, received
from .cases import Case
from .truth import truth_at

EARLIER_SEEDS, LATER_SEEDS = 9000, 1000
"""First seeds of the earlier and of the later trains."""

HOUR_NS = 3_600_000_000_000

FIRST_S = 1.0
"""Behind the demand of the full brake: what is foreseen in this time is what a train decides by."""

PAIRS = (("wet", "wet"), ("dry", "dry"), ("leaves", "leaves"), ("dry", "leaves"), ("leaves", "dry"))
"""Rail of the earlier trains, and of those that come later."""

FITTED = "gnss_doppler"

FOUND = ("first", "shortest", "least")


class Remembering(NamedTuple):
    """Some seeds of later trains behind some earlier ones: a task."""

    before: str
    now: str
    earlier: int
    seeds: int

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"remembered-{self.before}-{self.now}"

    @property
    def weight(self) -> float:
        """How much work it is: the runs."""
        return float(self.earlier + 2 * self.seeds)

    def compute(self) -> Arrays:
        """Safe over true way of every later train, without and with the map, shape (2, runs), as `safe_over_true`."""
        known = rail_map(Case(self.before, FITTED), range(EARLIER_SEEDS, EARLIER_SEEDS + self.earlier))
        case = Case(self.now, FITTED)
        drives = case.drives(range(LATER_SEEDS, LATER_SEEDS + self.seeds))
        configs = (case.config, replace(case.config, rail_map=known))
        ratios = np.array([[safe_over_true(drive, config) for drive in drives] for config in configs])
        return {"first": ratios[..., 0], "shortest": ratios[..., 1], "least": ratios[..., 2]}


def rail_map(case: Case, seeds: Iterable[int]) -> RailMap:
    """What the trains of a case saw, an hour before."""
    found = [braking.cells for drive in case.drives(seeds) for braking in brakings(_predictions(drive, case.config))]
    cells = pd.DataFrame(np.concatenate(found))
    rail = map_of(cells.assign(t_ns=cells["t_ns"] - HOUR_NS), CELL_M)
    return map_of_rows(rail.to_dict("records"))


def safe_over_true(drive: Drive, config: Config) -> Array:
    """Safe over remaining way: the mean and the least of the first second, and the least of the braking; shape (3,)."""
    made = list(_predictions(drive, config))
    stamps = np.array([one.estimate.t_ns * 1e-9 - START_S for one in made])
    truth, safe = truth_at(drive.journey, stamps), np.array([length_m(one) for one in made])
    since_s = stamps - drive.journey.full_from_s
    judged = (since_s >= 0.0) & (truth.true_speed_mps > config.slowest_mps)
    ratios, first = safe[judged] / truth.remaining_m[judged], since_s[judged] <= FIRST_S
    return np.array([ratios[first].mean(), ratios[first].min(), np.nanmin(ratios)])


def _predictions(drive: Drive, config: Config) -> Iterable[Any]:
    sent = (Sent(at_s, (received(message),)) for at_s, message in drive.messages)
    return (output.prediction for output in through(Pipeline(config, drive.journey.seed), sent).outputs)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study remembered`."""
    parser.add_argument("--runs", type=int, default=8, help="later trains of each rail")
    parser.add_argument("--earlier", type=int, default=6, help="trains before them")
    add_running_options(parser)


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Run what is missing; return two rows per pair of rails, without and with the map."""
    at_least(options, runs=1, earlier=1)
    tasks = [Remembering(before, now, options.earlier, options.runs) for before, now in PAIRS]
    table = [
        {
            **{"before": task.before, "now": task.now, "rail_map": with_map, "runs": task.seeds},
            **{"first_ratio": float(first.mean()), "first_short": float((shortest < 1.0).mean())},
            **{"least_ratio": float(least.min()), "short": float((least < 1.0).mean())},
        }
        for task, found in zip(tasks, run_all(tasks, running(options)), strict=True)
        for with_map, first, shortest, least in zip((False, True), *(found[name] for name in FOUND), strict=True)
    ]
    return table, "\n".join(lines(COLUMNS, table))


def _percent(name: str, row: Any) -> float:
    return 100.0 * float(row[name])


COLUMNS = (
    Column("earlier", 8, "", "before"),
    Column("now", 8, "", "now"),
    Column("map", 5, "", lambda row: "yes" if row["rail_map"] else "no"),
    Column("runs", 5, "d", "runs"),
    Column("safe/true, first second", 23, ".2f", "first_ratio"),
    Column("too short %", 11, ".0f", partial(_percent, "first_short")),
    Column("least later", 11, ".2f", "least_ratio"),
    Column("too short later %", 17, ".0f", partial(_percent, "short")),
)

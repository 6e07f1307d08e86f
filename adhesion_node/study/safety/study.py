# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study safety`: whether the ATP monitor says when a train needs more way than it has left, whatever is wrong.

Every case is a train by the equations of motion, settings, and messages with a fault (the rows of the table), all at
random. *hazardous*: the train came to need more way than was left to its target; *let go*: the monitor had let it go
before; *tight*: it was untold for a moment, so nothing was spare. *longest*: time from there until EMERGENCY_BRAKE, s,
and the largest share of the time that is stated for it; *grown*: way that came to be missing in that time, m; *judged*:
way that was missing where the monitor judged, and let the train go on, m. A *counterexample* exceeds what is stated in
doc/safety.md; one makes the exit code 1.
"""

import argparse
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...command.checks import at_least
from ...command.running import Arrays, add_running_options, run_all, running
from ..trial.text import Column, lines
from .faults.table import FAULTS
from .search import Outcome, case_of, outcome

CHUNK = 2000
"""Cases of a task."""

COLUMNS = (
    Column("fault", 24, "", "fault"),
    Column("cases", 8, "d", "cases"),
    Column("hazardous", 9, "d", "hazardous"),
    Column("let go", 8, "d", "let_go"),
    Column("tight", 8, "d", "tight"),
    Column("counterexamples", 15, "d", "counterexamples"),
    Column("longest s", 9, ".2f", "longest_s"),
    Column("of stated", 9, ".0%", "share_of_stated"),
    Column("grown m", 8, ".0f", "grown_m"),
    Column("judged m", 8, ".2f", "judged_m"),
)


@dataclass(frozen=True)
class Chunk:
    """Cases from a number on."""

    seed: int
    first: int
    count: int

    @property
    def name(self) -> str:
        """Of the file of its results."""
        return f"safety-{self.first}"

    @property
    def weight(self) -> float:
        """By cases."""
        return self.count

    def compute(self) -> Arrays:
        """Go through the cases."""
        found = [outcome(case_of(self.seed, number)) for number in range(self.first, self.first + self.count)]
        return {name: np.array(column) for name, column in zip(Outcome._fields, zip(*found, strict=True), strict=True)}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study safety`."""
    parser.add_argument("--cases", type=int, default=100_000, help="cases of all faults together")
    parser.add_argument("--seed", type=int, default=1, help="of the cases")
    add_running_options(parser)


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Run what is missing and return a row per fault and one of all."""
    at_least(options, cases=len(FAULTS), seed=0)
    firsts = range(0, options.cases, CHUNK)
    chunks = [Chunk(options.seed, first, min(CHUNK, options.cases - first)) for first in firsts]
    parts = list(run_all(chunks, running(options)))
    found = {name: np.concatenate([part[name] for part in parts]) for name in Outcome._fields}
    fault = np.arange(options.cases) % len(FAULTS)
    table = [_row(name, found, fault == index) for index, name in enumerate(FAULTS)]
    table.append(_row("all", found, fault >= 0))
    against = np.flatnonzero(found["counterexample"])[:5]
    told = [
        f"counterexample: case {number} of seed {options.seed}, {list(FAULTS)[fault[number]]}" for number in against
    ]
    return table, "\n".join([*lines(COLUMNS, table), *told])


def _row(name: str, found: Arrays, wanted: Any) -> dict[str, Any]:
    of = {key: column[wanted] for key, column in found.items()}
    return {
        "fault": name,
        "cases": int(wanted.sum()),
        "hazardous": int(of["hazardous"].sum()),
        "let_go": int((of["hazardous"] & of["free"]).sum()),
        "tight": int((of["untold_s"] > 0.0).sum()),
        "counterexamples": int(of["counterexample"].sum()),
        "longest_s": float(of["untold_s"].max()),
        "share_of_stated": float((of["untold_s"] / of["stated_s"]).max()),
        "grown_m": float(of["excess_m"].max()),
        "judged_m": float(of["judged_m"].max()),
    }

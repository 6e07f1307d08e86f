# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`python -m sim_node.real.plant`: the plant's figures per scenario, to hold beside what is published."""

import argparse
import json
import sys

import numpy as np

from .scenarios import SCENARIOS
from .simulate import simulate
from .validation import Figures, figures

HEAD = (
    "| scenario | way, m | mean, m/s² | used | available | groups sliding | used/available | creep, median "
    "| 4–20 % | 95 % below | cycles/s |"
)


def main() -> int:
    """Print one row per scenario: means over the seeds; with --json an object of them by scenario."""
    parser = argparse.ArgumentParser(prog="python -m sim_node.real.plant", description=__doc__)
    parser.add_argument("scenarios", nargs="*", metavar="SCENARIO", help=", ".join(SCENARIOS))
    parser.add_argument("--seeds", type=int, default=5, metavar="N", help="runs per scenario (default: %(default)s)")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args()
    unknown = sorted(set(options.scenarios) - set(SCENARIOS))
    if unknown or options.seeds < 1:
        parser.error(f"no such scenario: {', '.join(unknown)}" if unknown else "--seeds: give at least 1")
    rows: dict[str, Figures] = {}
    if not options.json:
        print(HEAD, "|---" * 11 + "|", sep="\n")
    for name in options.scenarios or SCENARIOS:
        rows[name] = mean(name, options.seeds)
        if not options.json:
            print(shown(name, rows[name]), flush=True)
    if options.json:
        print(json.dumps({name: row._asdict() for name, row in rows.items()}, indent=2))
    return 0


def mean(name: str, seeds: int) -> Figures:
    """Return the means over the seeds of one scenario, of those in which a figure exists."""
    scenario = SCENARIOS[name]
    built_up = 1.2 * scenario.nominal.build_up_s + scenario.nominal.length_m / scenario.nominal.propagation_mps + 1.0
    table = np.array([figures(journey, built_up) for journey in simulate(scenario, range(seeds))])
    there = np.isfinite(table)
    means = np.where(there, table, 0.0).sum(axis=0) / np.maximum(there.sum(axis=0), 1)
    return Figures(*np.where(there.any(axis=0), means, np.nan).tolist())


def shown(name: str, row: Figures) -> str:
    """Return a row of the table."""
    shares = [f"{100 * value:.0f} %" if np.isfinite(value) else "–" for value in row[4:9]]
    cycles = f"{row.cycles_hz:.2f}" if np.isfinite(row.cycles_hz) else "–"
    front = [f"{row.stop_m:.0f}", f"{row.deceleration_mps2:.2f}", f"{row.used:.3f}", f"{row.available:.3f}"]
    return f"| {' | '.join([name, *front, *shares, cycles])} |"


if __name__ == "__main__":
    sys.exit(main())

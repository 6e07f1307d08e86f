# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`report BRAKINGS.parquet`: the page of a table of brakings."""

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...command.checks import refuse
from ...command.options import DONE, FAILED, report
from ...command.written import write_text
from ..found.distances import FIXED_MU
from . import is_table
from .page import fleet_page
from .rail import low_spots, read_fleet

OF_RECORDINGS = ("seed", "set", "params", "train", "node", "estimate", "remap", "namespace", "target", "out")
"""Options that say how recordings are estimated and shown."""


def report_fleet(paths: Sequence[str], options: argparse.Namespace) -> int:
    """Write the page and say what it shows; the exit code of the tool."""
    low = FIXED_MU if options.low is None else options.low
    if not 0.0 < low <= 1.0:
        raise ValueError(f"low = {low}: give an adhesion coefficient above 0, to 1")
    recordings = [path for path in paths if not is_table(path)]
    if recordings:
        raise ValueError(f"bags = {', '.join(recordings)}: give recordings, or tables of brakings, not both")
    refuse(options, OF_RECORDINGS, "tables are shown as written: leave it out")
    fleet = read_fleet([Path(path) for path in paths])
    for remark in fleet.remarks:
        print(f"report: {remark}", file=sys.stderr)
    html, spots = fleet_page(fleet, low), low_spots(fleet.rail, low)
    output = Path(options.output)
    output.mkdir(parents=True, exist_ok=True)
    page = output / "report.html"
    write_text(page, html)
    limited = int(fleet.brakings["mu"].notna().sum())
    result: dict[str, Any] = {"page": str(page), "brakings": len(fleet.brakings), "limited": limited}
    unknown = {"mu_lower": None}
    result["low_spots"] = [spot._asdict() | (unknown if math.isnan(spot.mu_lower) else {}) for spot in spots]
    lines = [f"{len(fleet.brakings)} brakings, the adhesion limited in {limited}; low spots: {len(spots)}"]
    lines += [f"{s.from_m:.0f} to {s.to_m:.0f} m: {s.lowest:.4f}, {s.low_dates} of {s.dates} dates" for s in spots]
    report(options.json, result, "\n".join([*lines, str(page)]))
    if not limited:
        print("report: nothing is identified: the adhesion limited in no braking", file=sys.stderr)
    return DONE if limited else FAILED

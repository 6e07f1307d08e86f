# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Reports that the tests of their pages open in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slowing import TRUTH, record
from test_report_brakings import journey

from adhesion_node.report.__main__ import main


def two_runs(folder: Path) -> str:
    """Return the address of a report of two runs, the second without truth: 80 m/s, 2 m/s^2 slower each second."""
    bags = [str(record(folder / "with")), str(record(folder / "without", *TRUTH))]
    return _written(folder, *bags, "--target", "180")


def an_hour(folder: Path) -> str:
    """Return the address of a report of seven brakings in an hour; in the second one the rail gets worse."""
    return _written(folder, str(journey(folder / "hour", 7)), "--target", "60")


def _written(folder: Path, *options: str) -> str:
    assert main([*options, "--output", str(folder / "report")]) == 0
    return (folder / "report" / "report.html").as_uri()


def shown_range(page: Any, chart: int) -> list[float]:
    found: list[float] = page.evaluate(
        "(i) => { const s = [...drawn][i].plot.scales.x; return [s.min, s.max]; }", chart
    )
    return found

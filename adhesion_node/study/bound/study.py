# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study bound`: the posterior Cramér-Rao bound of mu over a braking: what no estimator can beat.

Rail condition unknown, speed law known, 10 Hz, nominal process noise. The speed before braking is what 20 s of
cruising leave known of it or, for comparison, a given standard deviation.
"""

import argparse
import math
from typing import Any

import numpy as np

from ...core.physics.train import KMH
from ..trial.figures import add_figure_options, figures_of
from ..trial.text import Column, lines
from .cramer_rao import MEAN_OF_STD, speed_lost, std_that_stays_within
from .nominal import Case, nominal

LOST_KMH = (10, 15, 20, 30, 50, 100)
"""Speeds lost at which the table gives the bound."""

ERROR_PERCENT = 5.0

CASES = (
    *(Case(scenario, sigma_m) for scenario in ("tunnel_entry", "tunnel_exit") for sigma_m in (0.1, 0.5, 2.0)),
    *(Case("tunnel_entry", *known) for known in ((0.5, 1.0), (0.5, 0.15), (0.1, 0.15), (2.0, 0.15))),
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study bound`."""
    add_figure_options(parser, "the bound over the speed lost")


def row(case: Case) -> dict[str, Any]:
    """The figures of a line: standard deviations of mu in %, and speeds lost in km/h, None where not reached."""
    found = nominal(case)
    braked = found.bound.lost_mps > 0.0
    lost, std = found.bound.lost_mps[braked], 100.0 * found.bound.mu_relative_std[braked]
    thresholds = {
        "mean": ERROR_PERCENT / MEAN_OF_STD,
        "half": std_that_stays_within(ERROR_PERCENT, 0.5),
        "most": std_that_stays_within(ERROR_PERCENT, 0.95),
    }
    reached = {name: speed_lost(found.bound, std / 100.0) / KMH for name, std in thresholds.items()}
    return {
        **case._asdict(),
        "std_percent": {str(kmh): float(np.interp(kmh * KMH, lost, std)) for kmh in LOST_KMH},
        "mean_error_percent": found.mean_error_percent,
        "lost_kmh": {name: kmh if math.isfinite(kmh) else None for name, kmh in reached.items()},
    }


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Return the table."""
    figures = figures_of(options)
    table = [row(case) for case in CASES]
    if figures is not None:
        from .figures import draw

        draw({case: nominal(case) for case in CASES if case.speed_std_kmh is None}, figures)
    return table, "\n".join([HEAD, *lines(COLUMNS, table)])


HEAD = (
    "least standard deviation of mu, %, after so many km/h of braking; mean |error|, %, after 30 km/h;\n"
    f"km/h lost until |error| is below {ERROR_PERCENT:g} %: on average, for good in half and in 95 % of the runs"
)


def _figure(group: str, name: str, head: str, form: str) -> Column:
    return Column(head, 5, form, lambda row: row[group][name])


COLUMNS = (
    Column("scenario", 12, "", "scenario"),
    Column("sigma m", 7, "g", "sigma_m"),
    Column("speed to km/h", 13, "g", "speed_std_kmh"),
    *(_figure("std_percent", f"{kmh}", f"{kmh}", ".2f") for kmh in LOST_KMH),
    Column("error", 5, ".2f", "mean_error_percent"),
    *(_figure("lost_kmh", name, head, ".1f") for name, head in (("mean", "mean"), ("half", "half"), ("most", "95 %"))),
)

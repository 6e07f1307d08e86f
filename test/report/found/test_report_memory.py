# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A long run: what is found of it holds a few of its columns at once, not each of its numbers as an object."""

import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from adhesion_node.core import Regime
from adhesion_node.report.found.brakings import brakings
from adhesion_node.report.found.events import text_changes
from adhesion_node.report.found.findings import first_identified, why_not
from adhesion_node.report.found.regimes import bands
from adhesion_node.report.found.rows import KEYS, rows_of
from adhesion_node.report.read.run import Run
from adhesion_node.report.read.series import Series

ESTIMATES = 60_000
COLUMN_BYTES = 8 * ESTIMATES
TIMES = np.arange(ESTIMATES) * 500_000_000


def long_run() -> Run:
    """Return 80 m/s and a brake that limits, at last the adhesion; nothing brakes."""
    series = Series(TIMES, np.full(ESTIMATES, 80.0))
    regimes = np.array([Regime.BRAKE_LIMITED.name] * (ESTIMATES - 1) + [Regime.ADHESION_LIMITED.name], dtype=object)
    told = dict.fromkeys((*KEYS, "position_std_m", "speed_std_mps"), series)
    mu = series.map(lambda values: values / 1e3)
    return Run(mu=mu, mu_lower=mu, position=series, speed=series, regime=Series(TIMES, regimes), told=told)


@pytest.mark.parametrize(
    ("find", "columns"),
    [
        (why_not, 10.0),
        (bands, 5.0),
        (brakings, 8.0),
        (first_identified, 6.0),
        (lambda run: text_changes(run.regime), 1.0),
        (lambda run: sum(1 for _ in rows_of(run, 1)), 50.0),  # a file has so many columns
    ],
)
def test_it_holds_a_few_columns(find: Callable[[Run], Any], columns: float) -> None:
    run = long_run()
    tracemalloc.start()
    try:
        find(run)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < columns * COLUMN_BYTES

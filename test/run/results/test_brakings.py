# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Brakings as rows: where one begins and ends, what it says of the rail, and what it showed by place."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest

from adhesion_node.core import Config, Estimate, Prediction, Regime, predict
from adhesion_node.run.results.brakings import brakings

S = 10**9
ADHESION, BRAKE, NOTHING = Regime.ADHESION_LIMITED, Regime.BRAKE_LIMITED, Regime.COASTING


def at(t_s: float, speed_mps: float, regime: Regime, mu: float = 0.1, *, window: int = 5) -> Prediction:
    std = 0.004
    estimate = Estimate(
        *(round(t_s * S), mu, std, mu - 2 * std, regime, 40.0 * t_s, speed_mps, 0.5, 0.1), window=window
    )
    return predict(Config(), estimate)


def braking(start_s: float, regime: Regime, mu: float = 0.1, seconds: int = 10) -> list[Prediction]:
    """A braking of 1 m/s^2 with an estimate a second, free motion before and behind it."""
    free = [at(start_s + t, 40.0, NOTHING, 0.05, window=0) for t in (-1, seconds)]
    return [free[0], *(at(start_s + t, 40.0 - t, regime, mu) for t in range(seconds)), free[1]]


def test_a_braking_is_a_row_of_what_it_was_and_showed() -> None:
    (found,) = brakings(braking(100.0, ADHESION, 0.07))
    (row,) = found.row
    assert (row["t_ns"], row["estimates"]) == (100 * S, 10)
    assert (row["place_m"], row["place_end_m"], row["distance_m"]) == (4000.0, 4360.0, 360.0)
    assert (row["from_kmh"], row["to_kmh"]) == pytest.approx((144.0, 111.6))
    assert (row["duration_s"], row["deceleration_mps2"]) == pytest.approx((9.0, 1.0))
    assert (row["mu"], row["mu_std"], row["mu_least"], row["used"]) == pytest.approx((0.07, 0.004, 0.07, 0.07))
    assert row["mu_lower"] == pytest.approx(0.062)
    assert [row[f"share_{name}"] for name in ("adhesion", "brake", "unclaimed")] == [1.0, 0.0, 0.0]
    first = at(100.0, 40.0, ADHESION, 0.07)
    assert first.safe is not None
    assert row["safe_m"] == first.safe.distance_m[-1]


def test_places_are_chainage_where_that_falls_along_the_run() -> None:
    (found,) = brakings(braking(100.0, ADHESION, 0.07), sign=-1)
    (row,) = found.row
    assert (row["place_m"], row["place_end_m"], row["distance_m"]) == (-4000.0, -4360.0, 360.0)
    assert found.cells["cell"].max() < 0


def test_where_the_brake_limits_only_at_least_is_known() -> None:
    (found,) = brakings([*braking(100.0, BRAKE, 0.09)[:6], *braking(100.0, BRAKE, 0.08)[6:]])
    (row,) = found.row
    assert math.isnan(row["mu"])
    assert row["mu_lower"] == pytest.approx(0.082), "the highest that was shown"
    assert row["share_brake"] == 1.0
    assert not found.cells["limited"].any()
    assert np.isnan(found.cells["mu"]).all()


def test_the_worst_counts_where_adhesion_limits_anywhere() -> None:
    worse = [made if k != 4 else at(103.0, 37.0, ADHESION, 0.05) for k, made in enumerate(braking(100.0, BRAKE, 0.09))]
    (found,) = brakings(worse)
    assert found.row["mu_least"] == pytest.approx(0.05)
    assert found.row["mu_lower"] == pytest.approx(0.042)
    by_place = {cell["cell"]: cell for cell in found.cells}
    assert by_place[41]["limited"]
    assert by_place[41]["mu_lower"] == pytest.approx(0.042)
    assert by_place[42]["mu_lower"] == pytest.approx(0.082)


def test_what_was_hardly_seen_says_nothing_of_the_rail() -> None:
    unsure = [made._replace(estimate=made.estimate._replace(mu_std=0.03)) for made in braking(100.0, NOTHING)]
    (found,) = brakings(unsure)
    assert math.isnan(found.row["used"][0])
    assert math.isnan(found.row["mu_lower"][0])
    assert not found.cells.size


def test_no_share_is_below_zero_where_all_is_claimed() -> None:
    """1 - 2/11 - 9/11 is -1e-16, which `report` refused in the table."""
    claimed = [
        made if k not in (1, 2) else at(99.0 + k, 41.0 - k, ADHESION)
        for k, made in enumerate(braking(100.0, BRAKE, seconds=11))
    ]
    (found,) = brakings(claimed)
    assert found.row["share_unclaimed"] == 0.0


def test_release_and_gaps_divide_brakings_and_dabs_are_none() -> None:
    stream = [*braking(100.0, BRAKE), *braking(200.0, BRAKE)[1:], *braking(250.0, BRAKE, seconds=1)]
    assert [float(found.row["t_ns"][0]) / S for found in brakings(stream)] == [100.0, 200.0]
    joined = [made for made in stream if made.estimate.window]
    assert [float(found.row["t_ns"][0]) / S for found in brakings(joined)] == [100.0, 200.0]


def test_brakings_come_as_soon_as_they_are_over() -> None:
    read = 0

    def endless() -> Iterator[Prediction]:
        nonlocal read
        start_s = 100.0
        while True:
            for made in braking(start_s, BRAKE):
                read += 1
                yield made
            start_s += 60.0

    assert len(list(islice(brakings(endless()), 3))) == 3
    assert read <= 3 * 12

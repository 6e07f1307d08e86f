# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A map of the rail: what it tells a train that begins to brake, when it says nothing, and what it must never do."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as some
from journeys import braking, wet

from adhesion_node.core import Config, Measurement, Prediction, finish, init, predict, step
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.belief.rail_map import DAY_NS, Piece, RailMap, Trust, Way
from adhesion_node.core.physics.adhesion import SpeedLaw

NOTHING = Rail(0.058, 0.04, 0.02)
FLAT = SpeedLaw(0.08)
TRUST = Trust(0.9, 0.5)
HERE = Way(5000.0, 40.0, 100 * DAY_NS)


def seen(mu: float, *, count: int = 10, hours: float = 1.0, spread: float = 0.9, limited: bool = True) -> RailMap:
    """Return a map from 4 to 8 km, as it was some hours ago."""
    t_ns = HERE.t_ns - round(hours / 24 * DAY_NS)
    places = np.arange(4000.0, 8000.0, 100.0).tolist()
    return RailMap(tuple(Piece(at, 100.0, t_ns, count, mu, 0.005, spread * mu, 40.0, limited) for at in places))


def told(rail_map: RailMap, way: Way = HERE, trust: Trust = TRUST) -> Rail:
    return rail_map.informed(NOTHING, way, FLAT, trust)


def test_a_better_rail_raises_the_bound_and_never_above_what_was_seen() -> None:
    found = told(seen(0.10))
    assert NOTHING.lower < found.lower < 0.09
    assert NOTHING.mu < found.mu < 0.10
    assert told(seen(0.10), trust=Trust(1.0, 1e4)).lower > found.lower


def test_a_worse_rail_lowers_the_bound_from_the_first_sight_on() -> None:
    for count in (1, 10):
        found = told(seen(0.02, count=count))
        assert found.lower < NOTHING.lower
        assert found.mu < NOTHING.mu


@pytest.mark.parametrize(
    "rail_map",
    [RailMap(()), seen(0.10, count=2), seen(0.10, hours=48.0), seen(0.10, hours=-1.0)],
    ids=["empty", "thin", "old", "of times to come"],
)
def test_where_the_map_is_thin_or_not_of_now_it_makes_no_train_less_careful(rail_map: RailMap) -> None:
    found = told(rail_map)
    assert found.lower <= NOTHING.lower
    assert found.mu <= NOTHING.mu


def test_a_map_of_a_small_part_of_the_way_ahead_is_thin() -> None:
    """800 m are looked ahead: what no train showed counts as no braking, so 10 on an eighth of it are one."""
    part = RailMap(seen(0.10).pieces[10:11])
    assert told(part).lower <= NOTHING.lower
    assert told(part).mu <= NOTHING.mu
    assert NOTHING.lower < told(RailMap(seen(0.10).pieces[10:14])).lower < told(seen(0.10)).lower


def without(rail_map: RailMap, from_m: float, to_m: float) -> RailMap:
    """The map without what it knows between two places."""
    return RailMap(tuple(piece for piece in rail_map.pieces if not from_m <= piece.place_m < to_m))


@pytest.mark.parametrize("length_m", [100.0, 200.0, 400.0])
@pytest.mark.parametrize("speed", [40.0, -40.0])
def test_a_gap_just_where_the_train_brakes_makes_it_no_less_careful(length_m: float, speed: float) -> None:
    """All around it much was seen: of the gap itself nothing is known."""
    gap = (5000.0, 5000.0 + length_m) if speed > 0 else (5000.0 - length_m, 5000.0)
    found = told(without(seen(0.10), *gap), HERE._replace(speed_mps=speed))
    assert found.lower <= NOTHING.lower
    assert found.mu <= NOTHING.mu
    thin = [p._replace(seen=2) if gap[0] <= p.place_m < gap[1] else p for p in seen(0.10).pieces]
    assert told(RailMap(tuple(thin)), HERE._replace(speed_mps=speed)).lower <= NOTHING.lower


def test_a_gap_within_the_way_counts_by_its_length() -> None:
    whole = told(seen(0.10)).lower
    bounds = [told(without(seen(0.10), 5300.0, 5300.0 + gap_m)).lower for gap_m in (100.0, 200.0, 400.0)]
    assert NOTHING.lower < bounds[2] < bounds[1] < bounds[0] < whole
    assert bounds[0] == pytest.approx((300.0 * whole + 100.0 * NOTHING.lower) / 400.0, rel=0.01)


@given(known=some.lists(some.sampled_from([0, 1, 2, 3, 5, 50]), min_size=1, max_size=40), at_m=some.floats(0.0, 99.0))
@example(known=[3, 0, 0, 0, 50, 50], at_m=0.0)
def test_nowhere_is_a_train_slower_than_by_what_is_known_of_every_piece(known: list[int], at_m: float) -> None:
    """By v^2: as if each piece gave what its own brakings allow, and one that no train showed what is known without."""
    at, t_ns = HERE.position_m + at_m, HERE.t_ns - DAY_NS // 24
    places = [(HERE.position_m + 100.0 * k, count) for k, count in enumerate(known)]
    rail_map = RailMap(tuple(Piece(place, 100.0, t_ns, n, 0.10, 0.005, 0.09, 40.0) for place, n in places if n))
    found = told(rail_map, HERE._replace(position_m=at)).lower
    slow = HERE._replace(speed_mps=15.0)  # it stands before the end of what it looks ahead, whatever the rail gives
    highest = {n: told(seen(0.10, count=n), slow).lower if n >= 3 else NOTHING.lower for n in {*known, 50}}
    lost, reached = 0.0, 0.0
    for place, count in places:
        way = 100.0 - (at_m if place == HERE.position_m else 0.0)
        reached += way
        lost += way * min(highest[count], highest[50])
        if 2.0 * 9.81 * lost < HERE.speed_mps**2:
            assert found * reached <= lost + 1e-6


def test_elsewhere_nothing_is_known_and_the_way_is_looked_along() -> None:
    assert told(seen(0.10), HERE._replace(position_m=9000.0)) == NOTHING
    assert told(seen(0.10), HERE._replace(position_m=3500.0, speed_mps=-40.0)) == NOTHING
    assert told(seen(0.10), HERE._replace(position_m=8000.0, speed_mps=-40.0)).lower > NOTHING.lower
    assert told(seen(0.10).turned(), HERE._replace(position_m=-5000.0)) == told(
        seen(0.10), HERE._replace(speed_mps=-40.0)
    )


def test_age_fewer_brakings_and_distrust_discount_it() -> None:
    full = told(seen(0.10)).lower
    for less in (told(seen(0.10, hours=6.0)), told(seen(0.10, count=4)), told(seen(0.10), trust=Trust(0.5, 0.5))):
        assert NOTHING.lower < less.lower < full
    none = told(seen(0.10), trust=Trust(0.0, 0.5))
    assert none.mu == NOTHING.mu
    assert none.lower == pytest.approx(NOTHING.lower)


def test_what_is_told_is_as_unsure_as_what_was_seen_and_as_it_scatters() -> None:
    """By a map that is believed without doubt: trains that saw 0.08 and 0.12, each to 0.005, in turns."""
    sure = Trust(1.0, 1e6)
    assert told(seen(0.10, count=10**6), trust=sure).std == pytest.approx(0.005, rel=0.02)
    turns = [
        piece._replace(mu=(0.08, 0.12)[k % 2], lower=0.07) for k, piece in enumerate(seen(0.10, count=10**6).pieces)
    ]
    assert told(RailMap(tuple(turns)), trust=sure).std == pytest.approx(math.hypot(0.005, 0.02), rel=0.02)


def test_a_single_low_spot_counts_and_a_brake_that_builds_up_does_not() -> None:
    def with_spot(lower: float, limited: bool) -> RailMap:
        pieces = list(seen(0.10).pieces)
        pieces[12] = pieces[12]._replace(mu=lower, lower=lower, limited=limited)
        return RailMap(tuple(pieces))

    assert told(with_spot(0.03, limited=True)).lower < told(seen(0.10)).lower
    assert told(with_spot(0.03, limited=False)).lower == told(seen(0.10)).lower


def test_where_the_brake_alone_limited_everywhere_the_rail_gives_as_much_at_least() -> None:
    assert told(seen(0.10, limited=False)) == told(seen(0.10))


def test_a_fast_train_gets_less_of_what_slow_ones_saw() -> None:
    law = SpeedLaw(0.04, 13.7, 120.0)
    fast, same = (seen(0.10).informed(NOTHING, HERE._replace(speed_mps=v), law, TRUST) for v in (80.0, 40.0))
    assert fast.mu < same.mu
    assert seen(0.10).informed(NOTHING, HERE._replace(speed_mps=20.0), law, TRUST).mu == pytest.approx(same.mu)


@given(
    mu=some.floats(0.005, 0.4),
    spread=some.floats(0.1, 1.0),
    count=some.integers(1, 1000),
    hours=some.floats(-10.0, 1000.0),
    probability=some.floats(0.0, 1.0),
)
def test_whatever_was_seen_the_bound_is_between_both(
    mu: float, spread: float, count: int, hours: float, probability: float
) -> None:
    found = told(seen(mu, spread=spread, count=count, hours=hours), trust=Trust(probability, 0.5))
    low, high = sorted((NOTHING.lower, spread * mu))
    assert min(low, found.mu) - 1e-9 <= found.lower <= max(high, 1e-3) + 1e-9
    assert math.isfinite(found.std)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mu": math.nan}, "give finite numbers"),
        ({"length_m": 0.0}, "a length above 0"),
        ({"seen": 0}, "seen of at least 1"),
        ({"lower": 0.2}, "no lower above it"),
        ({"place_m": -1.0}, "lies before the one before it"),
    ],
)
def test_a_piece_that_says_nothing_is_refused(changes: dict[str, Any], message: str) -> None:
    good = Piece(0.0, 100.0, 0, 1, 0.1, 0.01, 0.09, 40.0)
    with pytest.raises(ValueError, match=message):
        RailMap((good, good._replace(**changes)))


def predictions(config: Config, measurements: list[Measurement]) -> list[Prediction]:
    state, made = init(config, 1), []
    for measurement in measurements:
        state, estimate = step(config, state, measurement)
        made += [] if estimate is None else [estimate]
    made += finish(config, state)[1]
    return [predict(config, estimate) for estimate in made]


def test_the_safe_curve_is_shorter_at_the_onset_and_the_same_once_the_rail_is_known() -> None:
    """80 m/s on a wet rail, from 9 km on; behind the fifth second a full brake."""
    measurements = [
        one._replace(t_ns=one.t_ns + 100 * DAY_NS, position_m=one.position_m + 9000.0)
        for one in braking(wet(), 12.0, seed=3).measurements
    ]
    places = np.arange(9000.0, 15000.0, 100.0).tolist()
    pieces = tuple(Piece(at, 100.0, 100 * DAY_NS - 10**12, 20, 0.077, 0.004, 0.07, 75.0) for at in places)
    without, remembered = (
        predictions(config, measurements) for config in (Config(), replace(Config(), rail_map=RailMap(pieces)))
    )
    onset = next(k for k, made in enumerate(without) if made.estimate.window > 0)
    plain, informed = (made[onset].safe for made in (without, remembered))
    assert plain is not None
    assert informed is not None
    assert informed.distance_m[-1] < 0.9 * plain.distance_m[-1]
    assert [made.estimate for made in remembered[: onset - 1]] == [made.estimate for made in without[: onset - 1]]
    assert remembered[-1].estimate.mu == pytest.approx(without[-1].estimate.mu, rel=0.02)
    assert remembered[-1].estimate.mu_lower == pytest.approx(without[-1].estimate.mu_lower, rel=0.03)


def test_the_configuration_takes_a_map_alone() -> None:
    wrong: Any = "rail.csv"
    with pytest.raises(ValueError, match=r"rail_map = 'rail\.csv': give a RailMap, or None"):
        Config(rail_map=wrong)
    with pytest.raises(ValueError, match="rail_map with method = rail_condition: only bank begins with a map"):
        Config(rail_map=RailMap(()), method="rail_condition")

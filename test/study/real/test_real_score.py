# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The scores of `study real`: hand-made estimates with known answers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adhesion_node.study.real.cases import CASES
from adhesion_node.study.real.goals import goals, missed
from adhesion_node.study.real.possible.information import soonest_s
from adhesion_node.study.real.score import FIGURES, of_run, score
from adhesion_node.study.real.trials import BORDER, ROW, RUN, Found
from adhesion_node.study.trial.trials import DROP

FROM_S, SLOW_S, END_S = 10.0, 60.0, 64.0


def found(seed: int = 1, borders: tuple[tuple[float, float, float], ...] = (), **columns: Any) -> Found:
    """A run with an estimate a second from 0 on that is right in all; the train loses 1 m/s in a second from 50 m/s."""
    times = np.arange(65.0)
    rows = np.zeros(times.size, dtype=ROW)
    rows["seed"], rows["t_s"], rows["out_s"] = seed, times, times + 0.1
    rows["true_speed_mps"] = rows["speed_mps"] = np.clip(60.0 - times, 0.0, 50.0)
    rows["used"], rows["available"], rows["slid"] = 0.1, 0.12, 1.0
    rows["remaining_m"] = rows["safe_m"] = np.where(times >= FROM_S, rows["true_speed_mps"] ** 2 / 2, np.nan)
    rows["mu"], rows["std"], rows["lower"], rows["naive"], rows["speed_std_mps"] = 0.1, 0.001, 0.098, 0.09, 0.1
    rows["regime"] = "ADHESION_LIMITED"
    for name, values in columns.items():
        rows[name] = values(times) if callable(values) else values
    run = [(seed, FROM_S, 12.5, SLOW_S, END_S, 50.0)]
    marks = [(seed, *border) for border in borders]
    return Found(
        rows, np.array(run, dtype=RUN), np.array(marks, dtype=BORDER), np.array([], dtype=DROP), np.array([1.0])
    )


def at(*times: float) -> Any:
    """Whether it is one of these times."""
    return lambda t_s: np.isin(t_s, times)


COUNTED = 44.0
"""Estimates from 13 s to 56 s: above 3 m/s, the brake built up."""

LATE = 38.0
"""Those after the first 30 km/h, from 19 s on."""


def test_what_is_right_in_all_misses_nothing() -> None:
    right = found()
    row = score(right)
    assert {name for name, value in row.items() if value is None} == {
        f"{name}{end}" for name in ("brake_limited_called_adhesion_limited", "found_s") for end in ("", "_worst")
    }
    assert (row["error_percent"], row["bound_kept"], row["safe"], row["shortfall_percent"]) == (0.0, 1.0, 1.0, 0.0)
    assert (row["limited_called_adhesion_limited"], row["regime_wrong"], row["silence_s"]) == (
        *(1.0, 0.0),
        pytest.approx(1.0),
    )
    assert row["naive_error_percent"] == pytest.approx(10.0)
    assert missed(CASES[0], {**row, "coverage95": 0.95}) == {}


def test_errors_and_coverage_count_after_the_first_30_kmh_while_adhesion_limits() -> None:
    off = found(
        mu=lambda t: np.select([t < 19, t == 20, t == 21, t == 22, t == 57], [0.5, 0.12, 0.09, 0.5, 0.9], 0.1),
        std=0.008,
        withheld=at(22.0),
        slid=lambda t: np.where(t == 30.0, 0.4, 1.0),
    )
    one = of_run(off)
    assert one["error_percent"] == pytest.approx(30.0 / (LATE - 2))
    assert one["coverage95"] == pytest.approx(1.0 - 1 / (LATE - 2))
    assert one["withheld"] == pytest.approx(1 / COUNTED)
    assert one["limited"] == pytest.approx(1 - 1 / COUNTED)


def test_of_a_slow_train_a_quarter_of_its_speed_is_enough() -> None:
    slow = found(mu=lambda t: np.where(t < 42.6, 0.2, 0.1))
    slow.runs["full_s"], slow.runs["built_s"], slow.runs["full_mps"] = 38.0, 38.5, 22.0
    assert of_run(slow)["error_percent"] == pytest.approx(0.0)  # below 16.5 m/s: from 44 s on


def test_a_bound_counts_always_even_of_what_is_withheld() -> None:
    high = found(lower=lambda t: np.where(np.isin(t, (12.0, 14.0, 40.0, 58.0)), 0.101, 0.098), withheld=at(14.0))
    high.rows["slid"][40] = 0.0
    one = of_run(high)
    assert one["bound_kept"] == pytest.approx(1 - 2 / COUNTED)
    assert one["bound_kept_limited"] == pytest.approx(1 - 1 / (COUNTED - 1))


def test_a_curve_may_be_5_m_short_and_none_is_no_lie() -> None:
    way = (60.0 - np.arange(65.0)) ** 2 / 2
    length = np.where(np.arange(65) < 57, way, 0.0)
    length[20], length[21], length[30], length[50] = way[20] - 4.9, way[21] - 5.1, 0.9 * way[30], np.nan
    length[54], length[40] = way[54] - 6.0, 1.2 * way[40]
    one = of_run(found(safe_m=length))
    assert one["safe"] == one["safe_everywhere"] == pytest.approx(1 - 3 / COUNTED)
    assert one["no_safe_curve"] == pytest.approx(1 / COUNTED)
    assert one["shortfall_percent"] == pytest.approx(10.0)
    long = way[13:57] > 100.0
    expected = 100.0 * np.nanmean((length[13:57] / way[13:57] - 1.0)[long])
    assert one["excess_percent"] == pytest.approx(expected)


def test_before_an_unseen_fall_and_2_s_behind_it_nobody_can_know() -> None:
    short = found(
        borders=((30.0, 31.0, 0.5), (40.0, 40.0, 2.0)),
        safe_m=lambda t: np.where(t < 33.0, 1.0, np.where(t == 45.0, 1.0, 1e4)),
    )
    one = of_run(short)
    assert one["safe"] == pytest.approx(1 - 1 / 24)  # from 33 s on
    assert one["safe_behind"] == pytest.approx(1 - 18 / 41)  # 13 to 29 s, 45 s
    assert one["safe_everywhere"] == pytest.approx(1 - 21 / COUNTED)


def test_a_way_that_a_rise_makes_shorter_is_no_excess() -> None:
    long = found(
        borders=((20.0, 20.0, 0.5), (30.0, 31.0, 2.0)),
        safe_m=lambda t: (60.0 - t) ** 2 / 2 * np.select([t < 22, t < 33], [0.5, 3.0], 1.1),
    )
    one = of_run(long)
    assert (one["excess_percent"], one["shortfall_percent"]) == pytest.approx((10.0, 0.0))


def test_regimes_are_wrong_where_they_claim_the_other_one() -> None:
    claimed = found(
        slid=lambda t: np.select([t < 20, t < 30], [0.0, 0.3], 1.0),
        regime=lambda t: np.select(
            [t < 16, t < 30, t < 34, t < 36],
            ["BRAKE_LIMITED", "ADHESION_LIMITED", "BRAKE_LIMITED", "COASTING"],
            "ADHESION_LIMITED",
        ),
    )
    one = of_run(claimed)
    assert one["brake_limited_called_adhesion_limited"] == pytest.approx(4 / 7)
    assert one["limited_called_brake_limited"] == pytest.approx(4 / 27)
    assert one["limited_called_coasting"] == pytest.approx(2 / 27)
    assert one["regime_wrong"] == pytest.approx(8 / 34)


@pytest.mark.parametrize(
    ("borders", "false"),
    [((), 2), ((30.0,), 1), ((19.0,), 1), ((19.0, 30.0), 0), ((4.0,), 2), ((6.0,), 1), ((33.0, 34.0), 1), ((25.0,), 1)],
)
def test_a_change_is_false_that_is_none_of_a_border_near(borders: tuple[float, ...], false: int) -> None:
    """The changes at 5 and 62 s are told while there is no brake; one border is no excuse for two changes."""
    told: dict[str, Any] = {"changes": lambda t: np.searchsorted([5.0, 20.0, 34.5, 62.0], t)}
    one = of_run(found(borders=tuple((at, at, 1.5) for at in borders), **told))
    assert one["false_changes_per_hour"] == pytest.approx(false * 72.0)


def test_the_speed_is_judged_by_its_own_deviation() -> None:
    off = found(speed_mps=lambda t: np.clip(60.0 - t, 0.0, 50.0) + np.where(t == 20.0, 0.31, 0.29))
    one = of_run(off)
    assert one["speed_beyond_3_std"] == pytest.approx(1 / COUNTED)
    assert one["speed_rms_mps"] == pytest.approx(np.sqrt((43 * 0.29**2 + 0.31**2) / 44))


def test_silence_is_the_longest_time_between_two_that_came_out() -> None:
    quiet = found()
    kept = [t for t in range(65) if t not in (3, 4, 5, 6, 30, 31, 59, 60, 61, 62, 63)]
    one = of_run(quiet._replace(rows=quiet.rows[kept]))
    assert (one["silence_s"], one["silence_braked_s"]) == pytest.approx((6.0, 6.0))
    early = of_run(quiet._replace(rows=quiet.rows[[0, *range(7, 65)]]))
    assert (early["silence_s"], early["silence_braked_s"]) == pytest.approx((7.0, 1.0))
    nothing = of_run(quiet._replace(rows=quiet.rows[:0]))
    assert (nothing["silence_s"], nothing["bound_kept"]) == (54.0, None)


def test_a_fall_is_found_when_mu_is_near_again() -> None:
    falls: dict[str, Any] = {"borders": ((30.0, 30.0, 0.5), (45.0, 45.0, 0.5))}
    used: dict[str, Any] = {"used": lambda t: np.select([t < 30.5, t < 45.5], [0.1, 0.05], 0.025)}
    late = found(mu=lambda t: np.select([t < 33.5, t < 46.5], [0.1, 0.059], 0.024), **falls, **used)
    # 0.1 at 31 to 33 s against 0.05, come out right at 34.1 s; 0.059 at 46 s, right at 47.1 s
    assert of_run(late)["found_s"] == pytest.approx((4.1 + 2.1) / 2)
    never = found(mu=0.1, **falls, **used)
    assert of_run(never)["found_s"] == pytest.approx((15.0 + 15.0) / 2)
    assert of_run(found(**falls))["found_s"] == 0.0


def test_over_the_seeds_stand_the_mean_and_the_worst() -> None:
    runs = [found(seed, lower=lambda t, seed=seed: np.where(t < 13 + 11 * seed, 0.11, 0.09)) for seed in (1, 2)]
    runs[1].rows["out_s"][30:] += 2.0
    both = Found(*(np.concatenate(parts) for parts in zip(*runs, strict=True)))
    dropped = np.array([(1, "OUTLIER", 3, 0.0), (2, "OUTLIER", 1, 0.0), (2, "LATE", 1, 0.0)], dtype=DROP)
    row = score(both._replace(drops=dropped))
    assert (row["runs"], row["bound_kept"], row["bound_kept_worst"]) == (2, pytest.approx(0.625), pytest.approx(0.5))
    assert (row["silence_s"], row["silence_s_worst"]) == pytest.approx((3.0, 3.0))
    assert row["dropped"] == {"LATE": 0.5, "OUTLIER": 2.0}


def test_every_case_has_its_goals() -> None:
    by_name = {case.name: {goal.figure: goal for goal in goals(case)} for case in CASES}
    assert len(CASES) == len(by_name) >= 30
    assert all(goal.figure in FIGURES for of_case in by_name.values() for goal in of_case.values())
    errors = [
        by_name[name]["error_percent"].most for name in ("wet gnss", "wet gnss_doppler", "leaves gnss", "patches gnss")
    ]
    assert errors == [4.0, 2.0, 4.0, 6.0]
    assert by_name["patches gnss_wheels"]["found_s"].most == 1.0
    bound_s = soonest_s("gnss", 0.04, 0.2)
    assert bound_s is not None
    assert by_name["patches gnss"]["found_s"].most == pytest.approx(1.2 * bound_s)
    assert "found_s" not in by_name["wet gnss_wheels"]
    assert "excess_percent" not in by_name["wet tacho"]


def test_a_figure_misses_by_its_distance() -> None:
    row = {**dict.fromkeys(FIGURES), "bound_kept": 0.59, "coverage95": 1.0, "shortfall_percent": 5.0, "silence_s": 1.5}
    assert missed(CASES[0], row) == pytest.approx({"bound_kept": -0.36, "coverage95": 0.01, "silence_s": 0.5})

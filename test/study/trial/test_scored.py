# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The one score: hand-made estimates with known answers, and the score of an offline replay as oracle."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from adhesion_node.core import Config, Estimate, Regime
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.results.score import Truth, mean_relative_error_percent
from adhesion_node.study.trial.estimators import Lane, LaneResult, Output
from adhesion_node.study.trial.score import Curve, converged_kmh, of_runs, over_speed, relative_percent, score
from adhesion_node.study.trial.trials import DROP, ROW, TRIAL, Results, Rows, _arrays, each_trial
from adhesion_node.study.trial.world import World, simulate


def rows_of(*values: tuple[float, float, float, float, float, bool, bool], seed: int = 0, start: float = 0.0) -> Rows:
    """True speed and mu, estimated mu, its std and bound, whether adhesion limits, whether it counts."""
    rows = np.zeros(len(values), dtype=ROW)
    rows["seed"], rows["start"], rows["t_ns"] = seed, start, np.arange(len(values)) * 10**9
    for name, column in zip(
        ("true_speed_mps", "true_mu", "mu", "std", "lower", "limited", "scored"), zip(*values, strict=True), strict=True
    ):
        rows[name] = column
    rows["out_s"], rows["safe_m"], rows["true_stopping_m"] = 1e-9 * rows["t_ns"], np.nan, np.nan
    return rows


def results(*rows: Rows) -> Results:
    runs = [(own["seed"][0], own["start"][0], 0, True) for own in rows]
    drops = np.array([], dtype=DROP)
    return Results(np.concatenate(rows), np.array(runs, dtype=TRIAL), drops, np.zeros(1), np.zeros(1))


RUN_OF_FOUR = rows_of(
    (80.0, 0.08, 0.04, 0.01, 0.03, True, False),
    (70.0, 0.08, 0.09, 0.01, 0.085, True, True),  # 12.5 % off, within 1.64 std; the bound is too high
    (60.0, 0.10, 0.07, 0.01, 0.06, True, True),  # 30 %, outside
    (20.0, 0.12, 0.00, 0.01, 0.00, False, False),
)


def test_errors_count_what_is_scored_only() -> None:
    found = score(results(RUN_OF_FOUR))
    assert found["mean_relative_error_percent"] == pytest.approx(21.25)
    assert found["mean_abs_error"] == pytest.approx(0.02)
    assert found["mean_error"] == pytest.approx(-0.01)
    assert (found["coverage90"], found["coverage95"]) == (0.5, 0.5)
    assert (found["lower_bound_holds"], found["lower_bound_holds_scored"]) == (0.75, 0.5)


def test_what_is_withheld_counts_for_the_safe_curve_alone() -> None:
    rows = RUN_OF_FOUR.copy()
    rows["withheld"][2] = True
    rows["safe_m"], rows["true_stopping_m"] = [1000.0, np.nan, 900.0, 0.0], [900.0, 900.0, 1000.0, 0.0]
    found = score(results(rows))
    assert found["mean_relative_error_percent"] == pytest.approx(12.5)
    assert found["safe_curve_holds"] == pytest.approx(2 / 3)
    assert (found["shortest_safe_curve"], found["without_safe_curve"]) == (0.9, 0.25)


def test_claims_changes_and_silence() -> None:
    rows = RUN_OF_FOUR.copy()
    rows["claimed"][3], rows["changes"], rows["out_s"] = True, [1, 2, 0, 1], [0.0, 1.0, 8.0, 9.0]
    found = score(results(rows, rows_of(*[(80.0, 0.1, 0.1, 0.01, 0.0, False, False)] * 4, seed=1)))
    assert found["claimed_while_the_brake_limits"] == pytest.approx(1 / 5)
    assert found["changes_told"] == 2  # from 1 to 2, and again after a reset
    assert found["changes_per_hour"] == pytest.approx(2 * 3600 / 6)
    assert found["longest_silence_s"] == 7.0


def test_of_nothing_nothing_is_said() -> None:
    found = score(results(RUN_OF_FOUR).where(np.zeros(4, np.bool_)))
    assert found["runs"] == 1
    assert found["changes_told"] == 0
    assert {value for name, value in found.items() if name not in ("runs", "changes_told")} == {None}


def test_the_spread_is_that_of_the_runs_and_not_of_the_starts() -> None:
    found = score(
        results(
            *(
                rows_of((80.0, 0.1, 0.1 + 0.01 * k * (seed + 1), 0.01, 0.0, True, True), seed=seed, start=0.03 * k)
                for seed in range(2)
                for k in range(5)
            )
        )
    )
    assert found["runs"] == 2
    assert found["mean_relative_error_percent"] == pytest.approx(30.0)
    assert found["std_relative_error_percent"] == pytest.approx(10.0)  # runs of 20 % and 40 %
    assert found["p95_relative_error_percent"] == pytest.approx(39.0)


def test_trials_are_told_apart_by_seed_and_start() -> None:
    parts = [
        rows_of((80.0, 0.1, 0.1, 0.01, 0.0, True, True), seed=seed, start=start)
        for seed, start in ((1, 0.0), (1, 0.1), (2, 0.1))
    ]
    assert [own.size for own in each_trial(np.concatenate([*parts, parts[2]]))] == [1, 1, 2]
    assert of_runs(np.concatenate(parts), relative_percent).size == 2


def test_the_error_is_that_of_an_offline_replay() -> None:
    world = World("tunnel_entry")
    run, config = simulate(world, 3), Config()
    rng = np.random.default_rng(1)
    estimates = [
        Estimate(m.t_ns, float(rng.uniform(0.05, 0.1)), 0.01, 0.05, Regime.COASTING, 0.0, 0.0, 0.0, 0.0)
        for m in run.measurements[::10]
    ]
    truth = Truth()
    for t_ns, true in run.born.items():
        truth.mu[t_ns], truth.speed_mps[t_ns], truth.pressure_pa[t_ns] = true.mu, true.speed_mps, true.pressure_pa
    expected = mean_relative_error_percent(config, truth, estimates)
    result = LaneResult([Output(Prediction(estimate, None, None), estimate.t_ns * 1e-9) for estimate in estimates])
    arrays: Any = _arrays(Lane(run, 0.0), result)
    found = score(Results(**arrays, window_ms=np.zeros(1), seconds=np.zeros(1)))
    assert found["mean_relative_error_percent"] == pytest.approx(expected)


def test_an_estimate_between_two_samples_is_held_against_what_lies_between_them() -> None:
    """As those without a position may."""
    run = simulate(World("tunnel_entry"), 3)
    stamps = sorted(run.born)[-40:]
    early, late = (np.array([run.born[each][1:4] for each in of]) for of in (stamps[:-1], stamps[1:]))
    between = [(3 * one + other) // 4 for one, other in pairwise(stamps)]
    estimates = [Estimate(t_ns, 0.08, 0.01, 0.05, Regime.COASTING, 0.0, 0.0, 0.0, 0.0) for t_ns in between]
    result = LaneResult([Output(Prediction(estimate, None, None), estimate.t_ns * 1e-9) for estimate in estimates])
    rows = _arrays(Lane(run, 0.0), result)["rows"]
    got = np.column_stack([rows[name] for name in ("true_position_m", "true_speed_mps", "true_mu")])
    assert got == pytest.approx(0.75 * early + 0.25 * late)


def test_converges_where_the_error_gets_small() -> None:
    speed = np.array([300.0, 290.0, 280.0, 270.0, 260.0])
    assert converged_kmh(Curve(speed, np.array([50.0, 9.0, 6.0, 3.0, 2.0]))) == 270.0
    assert converged_kmh(Curve(speed, np.full(5, 1.0))) == 300.0
    assert converged_kmh(Curve(speed, np.full(5, 12.0))) is None


def test_error_over_speed_is_the_mean_over_the_runs() -> None:
    one = rows_of((80.0, 0.1, 0.11, 0.01, 0.0, True, True), (70.0, 0.1, 0.1, 0.01, 0.0, True, True))
    other = rows_of((82.0, 0.1, 0.13, 0.01, 0.0, True, True), (30.0, 0.1, 0.0, 0.01, 0.0, False, False), seed=1)
    curve = over_speed(results(one, other))
    assert curve.speed_kmh == pytest.approx([81.0 * 3.6, 70.0 * 3.6])
    assert curve.relative_error_percent == pytest.approx([20.0, 0.0])

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The safe braking curve under the faults: never shorter than the true distance to a standstill, at its confidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adhesion_node.study.robust.cases import FAULTS as CASES
from adhesion_node.study.robust.cases import Case
from sim_node.train.plant import advance, stopping_distances
from sim_node.train.scenario import SCENARIOS

FAULTS = (
    *("no positions for 30 s", "30 % of the positions lost", "5 % outliers of 20 m", "Student t, 2 degrees of freedom"),
    *("0.3 s late, too late", "stamps 100 s back", "stamps stand still for 60 s", "stuck position for 10 s"),
    *("10, 1, 50 Hz in turn, ±30 %", "balise step of 2 m forward", "gauge pressure"),
    *("the same, grade_std 0.005", "the same, mass_std 0.1"),  # unless told so, no sensor knows of grade and mass
)
"""Those that the estimator can know of; with the others not a bit changes, or nothing is published."""

KNOWN = [case for case in CASES if case.name in FAULTS]


@pytest.mark.parametrize("case", KNOWN, ids=lambda case: case.name)
def test_the_safe_curve_is_never_shorter_than_the_true_distance(case: Case) -> None:
    config = replace(case.estimator.config, step=20)  # a quarter of the estimates, half the time
    trials = case.trials(1)._replace(first_seed=1, estimator=case.estimator._replace(config=config))
    rows = trials.compute()["rows"]
    under_fault = rows[rows["t_ns"] * 1e-9 >= case.world.plan.fault_start_s]
    assert under_fault.size >= 10
    assert np.all(np.isfinite(under_fault["safe_m"]))
    assert np.mean(under_fault["safe_m"] >= under_fault["true_stopping_m"]) >= config.confidence


def test_no_fault_is_left_out_by_its_name() -> None:
    assert len(KNOWN) == len(FAULTS)


@pytest.mark.parametrize(
    ("scenario", "within"),
    [("tunnel_entry", 1e-5), ("grade_unknown", 1e-5), ("overweight", 1e-5), ("low_adhesion_patch", 2e-3)],
)
@pytest.mark.parametrize("speed_mps", [80.0, 40.0])
def test_the_true_distance_is_that_of_the_simulated_train(scenario: str, within: float, speed_mps: float) -> None:
    run = SCENARIOS[scenario]
    place = run.brake.start_s * run.speed_mps + 200.0
    stop, speed = advance(run, run.brake.start_s, 600.0, place, speed_mps)
    assert speed == 0.0
    (found,) = stopping_distances(run, np.array([place]), np.array([speed_mps]))
    assert found == pytest.approx(stop - place, rel=within)


def test_a_longer_way_is_told_from_a_shorter_one() -> None:
    run = SCENARIOS["tunnel_entry"]
    speeds = np.array([80.0, 79.0, 0.0])
    ways = stopping_distances(run, np.full(3, 2000.0), speeds)
    assert ways[0] > ways[1] > ways[2] == 0.0

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study robust --only rails`: when a change of the rail is found, and what stands beside the clean run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adhesion_node.study.__main__ import main
from adhesion_node.study.robust import rails
from adhesion_node.study.robust.cases import PAPER, RAILS, Case
from adhesion_node.study.robust.rails import after_changes, row
from adhesion_node.study.trial.trials import DROP, ROW, TRIAL, Results, Rows
from adhesion_node.study.trial.world import World
from sim_node.train.scenario import SCENARIOS

CASE = Case("patch", World("low_adhesion_patch"))


def a_run(true_mu: list[float], **columns: Any) -> Rows:
    """An estimate a second on a rail that limits; errors of 1 % unless told otherwise."""
    rows = np.zeros(len(true_mu), dtype=ROW)
    rows["t_ns"] = np.arange(len(true_mu)) * 10**9
    rows["true_mu"], rows["limited"], rows["scored"], rows["std"] = true_mu, True, True, 0.01
    rows["mu"] = 1.01 * rows["true_mu"]
    for name, values in columns.items():
        rows[name] = values
    return rows


def results(*runs: Rows) -> Results:
    for seed, own in enumerate(runs):
        own["seed"] = seed
    table = np.array([(seed, 0.0, 0, True) for seed in range(len(runs))], dtype=TRIAL)
    return Results(np.concatenate(runs), table, np.array([], dtype=DROP), np.zeros(1), np.zeros(1))


PATCH = [0.1, 0.1, 0.05, 0.05, 0.05, 0.05, 0.1, 0.1, 0.1]
WRONG_FIRST = [0.101, 0.101, 0.1, 0.1, 0.0505, 0.0505, 0.05, 0.101, 0.101]


def test_a_change_is_found_and_the_error_small_again() -> None:
    found = after_changes(a_run(PATCH, mu=WRONG_FIRST, changes=[0, 0, 0, 0, 1, 1, 1, 1, 2]))
    assert found == [(3.0, 2.0), (3.0, 1.0)]
    assert after_changes(a_run(PATCH, mu=WRONG_FIRST)) == [(np.inf, 2.0), (np.inf, 1.0)]
    assert after_changes(a_run([0.1] * 9)) == []


def test_medians_over_the_runs_are_those_of_fall_and_rise() -> None:
    runs = [a_run(PATCH, changes=[0, 0, *changes]) for changes in ([1] * 7, [0, 0] + [1] * 5, [0, 0, 1, 1, 1, 1, 2])]
    found = row(CASE, results(*runs))
    assert found["found_s"] == [3.0, None]
    assert found["again_s"] == [0.0, 0.0]
    assert found["changes_per_hour"] is None


def test_on_one_rail_every_change_is_false() -> None:
    found = row(CASE, results(a_run([0.1] * 9, changes=[0] * 4 + [1] * 5), a_run([0.1] * 9)))
    assert found["changes_per_hour"] == pytest.approx(3600 / 16)
    assert (found["found_s"], found["again_s"], found["runs"]) == (None, None, 2)
    assert found["mean_relative_error_percent"] == pytest.approx(1.0)


def test_what_the_end_of_the_data_gives_does_not_count() -> None:
    found = row(CASE, results(a_run([0.1] * 3, mu=[0.1, 0.1, 0.2], at_end=[False, False, True])))
    assert found["mean_relative_error_percent"] == 0.0


def test_cases_stand_on_scenarios_of_the_simulator_and_tell_themselves_apart() -> None:
    assert {case.world.scenario for case in RAILS} <= set(SCENARIOS)
    assert len({case.name for case in RAILS}) == len({case[1:] for case in RAILS}) == len(RAILS)


def test_the_paper_takes_few_runs_and_errors_stand_beside_the_clean_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = {}

    def computed(wanted: Any, _where: Any) -> dict[Case, Results]:
        asked.update({case: trials.seeds for case, trials in wanted})
        return {case: results(a_run([0.1] * 9, mu=0.1 + 0.001 * (1 + i))) for i, case in enumerate(asked)}

    monkeypatch.setattr(rails, "grouped", computed)
    assert main(["robust", "--only", "rails", "--runs", "30", "--json", str(tmp_path / "rows.json")]) == 0
    assert {seeds for case, seeds in asked.items() if case.estimator == PAPER} == {10}
    assert {seeds for case, seeds in asked.items() if case.estimator != PAPER} == {30}
    table = json.loads((tmp_path / "rows.json").read_text())
    assert [entry["case"] for entry in table] == [case.name for case in RAILS]
    assert [entry["ratio_to_clean"] for entry in table[:3]] == pytest.approx([1.0, 2.0, 3.0])
    assert capsys.readouterr().out.splitlines()[1].split()[:5] == ["as", "believed", "1.00", "0.00", "1.00"]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study tune-ekf`: every pair of standard deviations, on seeds that no table uses; the best one first."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tasks import computed_here

from adhesion_node.study.__main__ import main
from adhesion_node.study.baselines.ekf import NAIVE, TUNED, Tuning
from adhesion_node.study.trial.trials import FIRST_SEED
from adhesion_node.study.xie import tune_ekf


def test_the_grid_holds_every_pair_in_both_scenarios_on_seeds_of_its_own() -> None:
    wanted = list(tune_ekf.grid(3))
    pairs = {tuning for (tuning, _), _ in wanted}
    assert len(pairs) == len(tune_ekf.MU_STDS) * len(tune_ekf.MU_NOISES)
    assert TUNED in pairs
    assert len(wanted) == len({key for key, _ in wanted}) == 2 * len(pairs)
    for (tuning, scenario), trials in wanted:
        assert (trials.estimator.tuning, trials.world.scenario, trials.seeds) == (tuning, scenario, 3)
        assert trials.first_seed >= FIRST_SEED + 1000


def test_the_best_tuning_stands_first_and_the_one_in_use_is_marked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tune_ekf, "MU_STDS", (NAIVE.mu_std, TUNED.mu_std))
    monkeypatch.setattr(tune_ekf, "MU_NOISES", (NAIVE.mu_noise, TUNED.mu_noise))
    options = ["--runs", "1", "--cache", str(tmp_path), "--json", str(tmp_path / "table.json")]
    with computed_here():
        assert main(["tune-ekf", *options]) == 0
    table = json.loads((tmp_path / "table.json").read_text())
    errors = [row["mean_relative_error_percent"] for row in table]
    assert errors == sorted(errors)
    assert len(errors) == 4
    assert errors[-1] > 3 * errors[0]
    marked = [line.endswith("in use") for line in capsys.readouterr().out.splitlines()[1:]]
    assert marked == [Tuning(row["mu_std"], row["mu_noise"]) == TUNED for row in table]

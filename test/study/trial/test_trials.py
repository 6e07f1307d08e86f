# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Trials: a world and an estimator give the same rows however their seeds are divided and whatever way they run."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tasks import computed_here

from adhesion_node.command.running import Arrays, Running, file_name, load, save
from adhesion_node.core import Config
from adhesion_node.study.baselines.ekf import NAIVE, TUNED, Tuning
from adhesion_node.study.trial.estimators import WAYS, Estimator, Lane
from adhesion_node.study.trial.trials import ROW, Results, Trials, grouped
from adhesion_node.study.trial.world import Refusal, World, simulate, ticks
from adhesion_node.wire.topics import ADHESION_INPUTS
from sim_node.faults.plan import Plan
from sim_node.train.sensors import SensorSettings

QUICK = Trials(
    World("tunnel_exit"),
    Estimator(Config(method="particle_em", window=20, particles=5, iterations=2), "core"),
    starts=(0.0, 0.09),
)
"""Trials of the paper's method in little time."""


@cache
def _quick() -> Arrays:
    return QUICK.compute()


def test_seeds_are_divided_so_that_each_comes_once() -> None:
    tasks = QUICK._replace(seeds=60).tasks()
    assert [task.seeds for task in tasks] == [25, 25, 10]  # from two starts each
    seeds = [seed for task in tasks for seed in range(task.first_seed, task.first_seed + task.seeds)]
    assert seeds == list(range(1000, 1060))


def test_what_is_of_the_same_seeds_is_run_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Trials] = []

    def noted(tasks: list[Trials], where: Running, as_given: bool) -> list[Any]:
        assert as_given
        given.extend(tasks)
        return [{name: np.full(1, task.first_seed) for name in Results._fields} for task in tasks]

    monkeypatch.setattr("adhesion_node.study.trial.trials.run_all", noted)
    both = QUICK._replace(seeds=60)
    wanted = [("light", both._replace(estimator=Estimator(way="ekf"))), ("heavy", both)]
    found = grouped(wanted, Running(Path()))
    assert [task.first_seed for task in given] == [1000, 1000, 1025, 1025, 1050, 1050]
    assert [task.estimator.way for task in given] == ["core", "ekf"] * 3, "the longer one first"
    assert [(name, some.seconds.tolist()) for name, some in found.items()] == [
        ("light", [1000, 1025, 1050]),
        ("heavy", [1000, 1025, 1050]),
    ]


def test_trials_come_back_from_the_cache_whole(tmp_path: Path) -> None:
    save(QUICK, _quick(), tmp_path)
    stored = load(QUICK, tmp_path)
    assert stored.keys() == _quick().keys()
    assert all(stored[name].tobytes() == values.tobytes() for name, values in _quick().items())
    assert stored["rows"].dtype == ROW


def test_trials_of_other_settings_have_another_file() -> None:
    estimator = QUICK.estimator
    others = [
        QUICK._replace(world=world)
        for world in (
            World("tunnel_entry"),
            World("tunnel_exit", SensorSettings(0.1)),
            World("tunnel_exit", plan=Plan("nan")),
        )
    ]
    others += [
        QUICK._replace(estimator=changed)
        for changed in (
            estimator._replace(config=replace(estimator.config, particles=6)),
            estimator._replace(way="ekf"),
            estimator._replace(tuning=NAIVE),
            estimator._replace(seed_shift=1),
        )
    ]
    assert (
        len({file_name(trials) for trials in (QUICK, QUICK._replace(seeds=2), QUICK._replace(starts=(0.0,)), *others)})
        == 10
    )


def test_other_seeds_of_the_estimator_see_the_same_runs() -> None:
    found, other = (
        QUICK._replace(estimator=QUICK.estimator._replace(seed_shift=shift)).compute()["rows"] for shift in (0, 7)
    )
    assert np.array_equal(found["true_mu"], other["true_mu"])
    assert np.array_equal(found["t_ns"], other["t_ns"])
    assert not np.array_equal(found["mu"], other["mu"])


def test_numbers_do_not_depend_on_the_workers_or_the_tasks(tmp_path: Path) -> None:
    both = QUICK._replace(seeds=2)
    apart = [("a", QUICK), ("a", QUICK._replace(first_seed=1001))]
    one, two = (grouped(apart, Running(tmp_path / f"{n}", workers=n))["a"] for n in (1, 2))
    assert one.rows.tobytes() == two.rows.tobytes()
    # sums may round otherwise in another batch
    np.testing.assert_allclose(both.compute()["rows"]["mu"], one.rows["mu"], rtol=1e-9)


def test_groups_hold_what_has_their_key(tmp_path: Path) -> None:
    trials = Trials(World("tunnel_exit"), Estimator(way="ekf"), seeds=2)
    other = trials._replace(world=World("tunnel_entry"))
    wanted = [("a", trials), ("b", other), ("a", trials._replace(first_seed=7, seeds=1))]
    with computed_here():
        groups = grouped(wanted, Running(tmp_path))
    assert list(groups) == ["a", "b"]
    assert sorted(set(groups["a"].rows["seed"])) == [7, 1000, 1001]
    assert sorted(groups["b"].runs["seed"]) == [1000, 1001]
    assert (groups["a"].seconds.size, groups["b"].window_ms.size) == (2, 2)


@pytest.mark.parametrize("way", WAYS)
def test_every_way_starts_where_it_is_told_and_finds_the_adhesion(way: str) -> None:
    trials = Trials(World("tunnel_exit"), Estimator(Config(step=10), way), starts=(0.0, 0.09))
    rows = trials.compute()["rows"]
    low, high = (rows[rows["start"] == start] for start in trials.starts)
    assert low.size == high.size > 10
    assert abs(low["mu"][-1] - high["mu"][-1]) < 1e-3
    assert np.mean(np.abs(rows["mu"] / rows["true_mu"] - 1.0)[rows["scored"]]) < 0.06


@pytest.mark.parametrize("tuning", [TUNED, NAIVE])
def test_a_filter_starts_where_it_is_told(tuning: Tuning) -> None:
    rows = Trials(World("tunnel_exit"), Estimator(way="ekf", tuning=tuning), starts=(0.0, 0.09)).compute()["rows"]
    low, high = (rows[rows["start"] == start] for start in (0.0, 0.09))
    assert low["mu"][0] < high["mu"][0]


def test_the_bank_has_no_start_and_runs_once_from_all() -> None:
    estimator, run = Estimator(Config(), "core"), simulate(World("tunnel_exit"), 1000)
    lanes = [Lane(run, start) for start in (0.0, 0.09)]
    together, alone = estimator.run(lanes), [estimator.run([lane]).results[0] for lane in lanes]
    assert len(together.window_ms) == 1
    assert together.results == alone


def test_the_pipeline_gives_the_estimates_of_the_core_and_curves_besides() -> None:
    pipeline, core = (
        Trials(World("tunnel_exit"), Estimator(way=way)).compute()["rows"] for way in ("pipeline", "core")
    )
    for name in ("t_ns", "mu", "std", "lower", "position_m", "speed_mps", "changes"):
        assert np.array_equal(pipeline[name], core[name]), name
    assert np.isnan(core["safe_m"]).all()
    assert np.isnan(core["true_stopping_m"]).all()
    assert np.all(pipeline["safe_m"] > pipeline["true_stopping_m"])
    assert pipeline["at_end"].sum() <= 1


def test_b_is_the_same_train_at_the_usual_rate() -> None:
    """Also for the fault that needs a run of its own rate."""
    world = World("tunnel_entry", plan=Plan("irregular"), period_s=0.02)
    faulty, clean = (list(islice(ticks(one, 3), 1001)) for one in (world, world.without_fault))
    assert [truth for truth, _ in faulty] == [truth for truth, _ in clean]
    stamps = [messages[-1].t_ns for _, messages in clean if messages]
    assert {later - earlier for earlier, later in pairwise(stamps)} == {100_000_000}


def test_a_run_holds_what_is_received_and_refused_at_its_time() -> None:
    run = simulate(World("cruise", plan=Plan("nan", 2.0, fault_share=1.0)), 1)
    refused = [(t_s, item) for t_s, received in run.sent for item in received if isinstance(item, Refusal)]
    assert {item.reason for _, item in refused} == {"NOT_FINITE"}
    assert {item.topic for _, item in refused} <= {topic.name for topic in ADHESION_INPUTS}
    assert refused[0][0] == 2.0
    assert len(refused) == 2 * 581  # pressure and position, 2 to 60 s
    assert len(run.measurements) == 601
    assert all(measurement.t_ns in run.born for measurement in run.measurements)

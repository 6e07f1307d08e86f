# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study tables`: its rows beside the paper's, the JSON and the pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import made_once
from tasks import computed_here

from adhesion_node.command.running import save
from adhesion_node.study.__main__ import main
from adhesion_node.study.trial.trials import DROP, ROW, TRIAL, Results
from adhesion_node.study.xie.methods import METHODS, STARTS, trials
from adhesion_node.study.xie.published import START_OF_MEAN, TABLES
from adhesion_node.study.xie.tables import digest, rows


def two_runs() -> Results:
    """From the starts an error of 0, 10, 20, 30, 40 % in the first run and twice that in the second."""
    table = np.zeros((2, len(STARTS)), dtype=ROW)
    table["seed"] = np.arange(2)[:, None]
    table["start"] = STARTS
    table["true_mu"], table["std"], table["true_speed_mps"] = 0.1, 0.01, 80.0
    table["mu"] = 0.1 + 0.01 * np.arange(5) * (1 + table["seed"])
    table["limited"] = table["scored"] = True
    table["lower"][:, 0] = 0.2
    runs = np.array([(seed, start, 0, True) for seed in range(2) for start in STARTS], dtype=TRIAL)
    return Results(table.ravel(), runs, np.array([], dtype=DROP), np.array([1.0, 3.0]), np.array([1.0, 2.5]))


def test_the_mean_over_the_starts_is_the_mean_of_the_lines() -> None:
    table = list(rows(("tunnel_entry", "ekf_tuned"), two_runs()))
    assert [row["start_mu"] for row in table] == [*STARTS, START_OF_MEAN]
    assert [row["mean_relative_error_percent"] for row in table] == pytest.approx([0.0, 15.0, 30.0, 45.0, 60.0, 30.0])
    assert table[-1]["std_relative_error_percent"] == pytest.approx(10.0)  # runs of 20 % and 40 %
    assert [row["lower_bound_holds"] for row in table] == pytest.approx([0.0, 1.0, 1.0, 1.0, 1.0, 0.8])
    assert table[0]["paper_mean_relative_error_percent"] == 13.7828
    assert (table[0]["seconds"], table[0]["ms_per_window_p50"]) == (3.5, 2.0)


def test_the_digest_is_that_of_the_estimates_start_by_start() -> None:
    found = two_runs()
    by_start = found._replace(rows=found.rows[np.argsort(found.rows["start"], kind="stable")])
    assert digest(by_start) == digest(found)
    other = found.rows.copy()
    other["mu"][3] = np.nextafter(other["mu"][3], 1.0)
    assert digest(found._replace(rows=other)) != digest(found)


def test_printed_means_are_those_of_the_printed_lines() -> None:
    for table in TABLES.values():
        for column in (1, 3):
            assert np.mean([table[start][column] for start in STARTS]) == pytest.approx(
                table[START_OF_MEAN][column], abs=6e-4
            )


def test_the_tables_stand_at_the_papers_settings() -> None:
    config = trials("tunnel_entry", METHODS["particle_em"], 1).estimator.config
    assert (config.method, config.window, config.step) == ("particle_em", 50, 10)
    assert (config.particles, config.iterations, config.position_noise_m) == (20, 50, 0.02)


def make_study(folder: Path) -> None:
    """`study tables --runs 1` with short stand-ins for the paper's method in the cache."""
    (folder / "cache").mkdir()
    for scenario in TABLES:
        wanted = trials(scenario, METHODS["particle_em"], 1)
        config = replace(wanted.estimator.config, window=20, particles=5, iterations=2)
        quick = wanted._replace(estimator=wanted.estimator._replace(config=config))
        save(wanted, quick.compute(), folder / "cache")
    file, cache, figures = (str(folder / name) for name in ("t.json", "cache", "figures"))
    options = ["--runs", "1", "--json", file, "--cache", cache, "--figures", figures, "--format", "svg"]
    with computed_here():
        assert main(["tables", *options]) == 0


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[dict[str, Any]], Path]:
    """The rows of the study and its figures."""
    folder = made_once(tmp_path_factory, "study_tables", make_study)
    return json.loads((folder / "t.json").read_text()), folder / "figures"


def test_json_of_the_tables(study: tuple[list[dict[str, Any]], Path]) -> None:
    table, _ = study
    assert len(table) == 2 * len(METHODS) * 6
    required = {"scenario", "method", "sigma_m", "runs", "start_mu", "mean_abs_error", "mean_relative_error_percent"}
    required |= {"converged_kmh", "coverage95", "bound_ratio", "seconds", "ms_per_window_p50", "ms_per_window_p99"}
    for row in table:
        assert required <= row.keys()
        assert 0.0 < row["mean_relative_error_percent"] < 60.0
        assert row["runs"] == 1
        assert row["sigma_m"] == 0.5
    assert len({row["digest"] for row in table}) == 2 * len(METHODS)
    by_method = {row["method"]: row for row in table if row["start_mu"] == START_OF_MEAN}
    tuned, naive = (by_method[name]["mean_relative_error_percent"] for name in ("ekf_tuned", "ekf_naive"))
    assert tuned < 4.0
    assert 9.0 < naive < 17.0


def test_every_figure_has_its_picture(study: tuple[list[dict[str, Any]], Path]) -> None:
    files = sorted(file.name for file in study[1].iterdir())
    assert [int(name[3:5]) for name in files] == [*range(4, 10), *range(14, 20)]
    for name in files:
        drawn = (study[1] / name).read_text(encoding="utf-8")
        for shown in ("bank, the default", "rail condition", "N = 1 runs from each of 5 starts"):
            assert shown in drawn, f"{name}: {shown}"
        assert drawn.count("one run, any start<") == 2, name  # of the two that need none
        assert ("extended Kalman filter, tuned" in drawn) is ("ekf" in name)
        assert "particle_em" not in drawn
        assert "tunnel_" not in drawn


@pytest.mark.parametrize("arguments", [["--runs", "0"], ["--workers", "0"]])
def test_bad_numbers_are_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tables", *arguments]) == 2
    assert f"{arguments[0][2:]} = 0: give at least 1" in capsys.readouterr().err

# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`study tables`: the figures of a table, the cache, the independence of workers, the JSON and the pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adhesion_node.core import Config, Estimate, Regime
from adhesion_node.run.score import mean_relative_error_percent
from adhesion_node.study.__main__ import main
from adhesion_node.study.trial.accuracy import Curve, converged_kmh, errors, figures, over_speed
from adhesion_node.study.trial.running import Running
from adhesion_node.study.trial.runs import ROW, rows_of, simulate
from adhesion_node.study.trial.tasks import Arrays, file_name, load, save
from adhesion_node.study.xie import distances
from adhesion_node.study.xie.methods import METHODS, STARTS, Lane
from adhesion_node.study.xie.montecarlo import Chunk, Result, chunks, result_of, results
from adhesion_node.study.xie.published import SAVINGS, START_OF_MEAN, TABLES
from adhesion_node.study.xie.tables import Cell, rows

QUICK = Chunk("tunnel_exit", "particle_em", 0.5, 1000, 1, Config(window=20, particles=5, iterations=2))
"""A chunk of the paper's method in little time."""


def _rows(*values: tuple[float, float, float, float, float, bool, bool]) -> np.ndarray:
    return np.array([(i, *row) for i, row in enumerate(values)], dtype=ROW)


@cache
def _quick() -> Arrays:
    return QUICK.compute()


def _same(one: Result, other: Result) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(one.rows, other.rows, strict=True))


def test_errors_count_what_is_scored_only() -> None:
    run = _rows(
        (80.0, 0.08, 0.04, 0.01, 0.03, True, False),
        (70.0, 0.08, 0.09, 0.01, 0.07, True, True),  # 12.5 % off, within 1.96 std
        (60.0, 0.10, 0.07, 0.01, 0.06, True, True),  # 30 %, outside
        (20.0, 0.12, 0.00, 0.01, 0.00, False, False),
    )
    found = errors([run])
    assert found.relative_percent == pytest.approx([21.25])
    assert found.absolute == pytest.approx([0.02])
    assert (found.coverage95, found.lower_bound_holds) == (0.5, 1.0)


def test_the_error_is_that_of_score() -> None:
    simulated, config = simulate("tunnel_entry", 3, 0.5), Config()
    rng = np.random.default_rng(1)
    estimates = [
        Estimate(m.t_ns, float(rng.uniform(0.05, 0.1)), 0.01, 0.05, Regime.COASTING, 0.0, 0.0, 0.0, 0.0)
        for m in simulated.measurements[::10]
    ]
    expected = mean_relative_error_percent(config, simulated.truth, estimates)
    assert errors([rows_of(config, simulated.truth, estimates)]).relative_percent == pytest.approx([expected])


def test_converges_where_the_error_gets_small() -> None:
    speed = np.array([300.0, 290.0, 280.0, 270.0, 260.0])
    assert converged_kmh(Curve(speed, np.array([50.0, 9.0, 6.0, 3.0, 2.0]))) == 270.0
    assert converged_kmh(Curve(speed, np.full(5, 1.0))) == 300.0
    assert converged_kmh(Curve(speed, np.full(5, 12.0))) is None


def test_error_over_speed_is_the_mean_over_the_runs() -> None:
    one = _rows((80.0, 0.1, 0.11, 0.01, 0.0, True, True), (70.0, 0.1, 0.1, 0.01, 0.0, True, True))
    other = _rows((82.0, 0.1, 0.13, 0.01, 0.0, True, True), (30.0, 0.1, 0.0, 0.01, 0.0, False, False))
    curve = over_speed([one, other])
    assert curve.speed_kmh == pytest.approx([81.0 * 3.6, 70.0 * 3.6])
    assert curve.relative_error_percent == pytest.approx([20.0, 0.0])


def test_the_mean_over_the_starts_is_the_mean_of_the_lines() -> None:
    runs = [[_rows((80.0, 0.1, 0.1 + e, 0.01, 0.0, True, True)) for e in (0.01 * s, 0.02 * s)] for s in range(5)]
    cell = Cell("tunnel_entry", "ekf_tuned", 0.5, runs, 1.0, np.array([1.0, 3.0]))
    table = list(rows(cell))
    assert [row["start_mu"] for row in table] == [*STARTS, START_OF_MEAN]
    assert table[-1]["mean_relative_error_percent"] == pytest.approx(30.0)
    assert table[-1]["mean_relative_error_percent"] == pytest.approx(
        np.mean([row["mean_relative_error_percent"] for row in table[:-1]])
    )
    assert table[-1]["std_relative_error_percent"] == pytest.approx(10.0)  # runs of 20 % and 40 %
    assert table[0]["paper_mean_relative_error_percent"] == 13.7828


def test_printed_means_are_those_of_the_printed_lines() -> None:
    for table in TABLES.values():
        for column in (1, 3):
            assert np.mean([table[start][column] for start in STARTS]) == pytest.approx(
                table[START_OF_MEAN][column], abs=6e-4
            )


def test_chunks_cover_every_run_once() -> None:
    some = chunks("tunnel_entry", "ekf_tuned", 0.5, 95, chunk=40)
    seeds = [seed for chunk in some for seed in range(chunk.first_seed, chunk.first_seed + chunk.seeds)]
    assert seeds == list(range(1000, 1095))


def test_the_tables_stand_at_the_papers_settings() -> None:
    config = chunks("tunnel_entry", "particle_em", 0.5, 1)[0].config
    assert (config.method, config.window, config.step) == ("particle_em", 50, 10)
    assert (config.particles, config.iterations, config.position_noise_m) == (20, 50, 0.02)


def test_a_chunk_comes_back_from_the_cache_whole(tmp_path: Path) -> None:
    save(QUICK, _quick(), tmp_path)
    stored, fresh = (result_of(QUICK, found) for found in (load(QUICK, tmp_path), _quick()))
    assert _same(stored, fresh)
    assert len(stored.rows) == len(STARTS)
    assert (stored.chunk, stored.seconds) == (QUICK, fresh.seconds)


def test_other_seeds_of_the_estimator_see_the_same_runs() -> None:
    found, other = _quick()["rows"], QUICK._replace(seed_shift=7).compute()["rows"]
    assert np.array_equal(found["true_mu"], other["true_mu"])
    assert np.array_equal(found["t_ns"], other["t_ns"])
    assert not np.array_equal(found["mu"], other["mu"])
    filtered = QUICK._replace(method="ekf_tuned")  # draws nothing
    assert filtered.compute()["rows"].tobytes() == filtered._replace(seed_shift=7).compute()["rows"].tobytes()


def test_a_chunk_of_other_settings_has_another_file() -> None:
    finer = replace(QUICK.config, particles=6)
    changed = (QUICK._replace(config=finer), QUICK._replace(seeds=2), QUICK._replace(sigma_m=0.1))
    others = (QUICK._replace(method="ekf_tuned"), QUICK._replace(scenario="tunnel_entry"), QUICK._replace(seed_shift=1))
    assert len({file_name(chunk) for chunk in (QUICK, *changed, *others)}) == 7


def test_numbers_do_not_depend_on_the_workers_or_the_chunks(tmp_path: Path) -> None:
    small = [QUICK, QUICK._replace(first_seed=1001)]
    one = list(results(small, Running(tmp_path / "1", workers=1)))
    two = list(results(small, Running(tmp_path / "2", workers=2)))
    assert all(_same(a, b) for a, b in zip(one, two, strict=True))
    both = QUICK._replace(seeds=2)
    for ours, apart in zip(result_of(both, both.compute()).rows, one[0].rows + one[1].rows, strict=True):
        np.testing.assert_allclose(ours["mu"], apart["mu"], rtol=1e-9)  # sums may round otherwise in another batch


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[dict[str, Any]], Path]:
    """`study tables --runs 1` with short stand-ins for the paper's method in the cache, and its figures."""
    folder = tmp_path_factory.mktemp("study")
    for scenario in TABLES:
        (wanted,) = chunks(scenario, "particle_em", 0.5, 1)
        quick = wanted._replace(config=QUICK.config)
        (folder / "cache").mkdir(exist_ok=True)
        save(wanted, quick.compute(), folder / "cache")
    file, cache, figures_ = (str(folder / name) for name in ("t.json", "cache", "figures"))
    assert main(["tables", "--runs", "1", "--json", file, "--cache", cache, "--figures", figures_]) == 0
    return json.loads(Path(file).read_text()), folder / "figures"


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
    assert all((study[1] / name).stat().st_size > 10_000 for name in files)


@pytest.mark.parametrize("arguments", [["--runs", "0"], ["--workers", "0"]])
def test_bad_numbers_are_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tables", *arguments]) == 2
    assert f"{arguments[0][2:]} = 0: give at least 1" in capsys.readouterr().err


def test_methods_start_where_they_are_told() -> None:
    simulated = simulate("tunnel_exit", 1, 0.5)
    lanes = [Lane(1, start, simulated) for start in (0.0, 0.09)]
    for name in ("ekf_tuned", "ekf_naive"):
        low, high = METHODS[name](Config(), lanes).rows
        assert low["mu"][0] < high["mu"][0]
        assert abs(low["mu"][-1] - high["mu"][-1]) < 1e-3
    assert figures([[low], [high]])["runs"] == 1


def test_savings_beside_the_papers() -> None:
    found = distances.savings(distances.rows())
    assert [saving[:2] for saving in found] == [(300, 100), (250, 50)]
    for ours, paper in zip(found, SAVINGS, strict=True):
        assert ours.distance_percent == pytest.approx(paper.distance_percent, abs=4.0)
        assert ours.time_percent == pytest.approx(paper.time_percent, abs=4.0)
    printed = [100 * (1 - 3481.1 / 3946.7), 100 * (1 - 2614.4 / 2958.9)]
    assert printed == pytest.approx([saving.distance_percent for saving in SAVINGS], abs=0.01)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Braking distances by the identified adhesion, and the sensitivity table: hand-made runs with known answers."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adhesion_node.command.running import Running
from adhesion_node.core.physics import braking
from adhesion_node.core.physics.adhesion import WET
from adhesion_node.core.physics.train import CRH3, KMH
from adhesion_node.study.__main__ import main
from adhesion_node.study.trial.trials import DROP, ROW, TRIAL, Results, Rows, Trials
from adhesion_node.study.xie import distances, sensitivity, tables
from adhesion_node.study.xie.methods import METHODS, STARTS, trials

Key = tuple[str, ...]


def a_run(from_kmh: float, to_kmh: float, scale: float) -> Rows:
    """A run whose estimates are the wet law times `scale`, and nonsense during the first 30 km/h."""
    speeds = np.linspace(from_kmh, to_kmh, 200) * KMH
    rows = np.zeros(speeds.size, dtype=ROW)
    rows["t_ns"], rows["true_speed_mps"], rows["true_mu"] = np.arange(speeds.size), speeds, WET(speeds)
    rows["mu"] = np.where(speeds > (from_kmh - 30.0) * KMH, 0.001, scale * WET(speeds))
    rows["std"], rows["limited"], rows["scored"] = 0.01, True, True
    return rows


def results(runs: Sequence[Rows]) -> Results:
    """Runs from one start each."""
    for rows, start in zip(runs, STARTS, strict=True):
        rows["start"] = start
    table = np.array([(0, start, 0, True) for start in STARTS], dtype=TRIAL)
    return Results(np.concatenate(runs), table, np.array([], dtype=DROP), np.zeros(1), np.zeros(1))


def test_the_true_law_gives_its_own_distance_save_for_the_first_30_kmh() -> None:
    distance, time = distances.by_identified(a_run(250.0, 50.0, 1.0), 250.0, 50.0).values()
    # By hand: down to 220 km/h with the adhesion of 220 km/h, from there with the law.
    first = braking.curve(CRH3, 250 * KMH, float(WET(np.array(220 * KMH))), 220 * KMH)
    rest = braking.curve(CRH3, 220 * KMH, WET, 50 * KMH)
    assert distance == pytest.approx(first.distance_m[-1] + rest.distance_m[-1], rel=1e-3)
    assert time == pytest.approx(first.time_s[-1] + rest.time_s[-1], rel=1e-3)


def test_a_run_without_converged_estimates_is_refused() -> None:
    with pytest.raises(ValueError, match="without an estimate after the first 30 km/h"):
        distances.by_identified(a_run(250.0, 225.0, 1.0), 250.0, 50.0)


def test_rows_tell_mean_band_and_saving() -> None:
    cells = {
        (name, "particle_em"): results([a_run(*speeds, scale) for scale in (0.9, 0.95, 1.0, 1.05, 1.1)])
        for name, speeds in distances.BRAKINGS.items()
    }
    entry, leaving = distances.identified(cells)
    assert (entry["from_kmh"], entry["runs"], leaving["to_kmh"]) == (300.0, 1, 50.0)
    for row in (entry, leaving):
        assert row["distance_m_p5"] < row["distance_m"] < row["distance_m_p95"]
        assert row["distance_m"] == pytest.approx(row["distance_m_true_law"], rel=0.02)
        fixed = braking.curve(CRH3, row["from_kmh"] * KMH, 0.0726, row["to_kmh"] * KMH)
        assert row["time_s_saved_percent"] == pytest.approx(100 - 100 * row["time_s"] / fixed.time_s[-1])


def test_both_methods_stand_beside_each_other_on_the_trials_of_the_tables(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Trials] = []

    def computed(wanted: Iterable[tuple[Key, Trials]], _where: Running) -> dict[Key, Results]:
        """Where the paper's method reads mu 10 % too low, and the default one is right."""
        found = {}
        for key, some in wanted:
            asked.append(some)
            scale = 0.9 if some.estimator.config.method == "particle_em" else 1.0
            run = a_run(*distances.BRAKINGS[some.world.scenario], scale)
            found[key] = results([run.copy() for _ in STARTS])
        return found

    monkeypatch.setattr(distances, "grouped", computed)
    assert main(["distances", "--runs", "1", "--json", str(tmp_path / "table.json")]) == 0
    table = [row for row in json.loads((tmp_path / "table.json").read_text()) if row["case"] == "identified"]
    assert [(row["from_kmh"], row["method"]) for row in table] == [
        (start, method) for start in (300.0, 250.0) for method in ("particle_em", "rail_condition")
    ]
    for paper, default in (table[:2], table[2:]):
        assert paper["distance_m"] > 1.05 * default["distance_m"]
        assert default["distance_m"] == pytest.approx(default["distance_m_true_law"], rel=0.02)
        assert paper["distance_m_true_law"] == default["distance_m_true_law"]
    lines = capsys.readouterr().out.splitlines()[-4:]
    assert [line.split()[3] for line in lines] == ["particle_em", "rail_condition"] * 2
    assert [float(line.split()[4]) for line in lines] == pytest.approx([row["distance_m"] for row in table], abs=0.05)

    by_distances = set(asked)
    asked.clear()
    monkeypatch.setattr(tables, "grouped", computed)
    monkeypatch.setattr(tables, "rows", lambda _cell, _found: ())
    monkeypatch.setattr(tables, "_digest_lines", lambda _table: ())
    assert main(["tables", "--runs", "1"]) == 0
    assert by_distances <= set(asked)


def test_one_setting_at_a_time_leaves_the_nominal_ones() -> None:
    nominal = {method: trials("tunnel_entry", METHODS[method], 3) for method in ("particle_em", "ekf_tuned")}
    for (setting, value, method), varied in sensitivity.variations(3):
        world, (config, *_) = varied.world, varied.estimator
        shown = {"sigma_m": world.sensors.position_std_m, "seed_shift": varied.estimator.seed_shift}
        assert value == (shown[setting] if setting in shown else getattr(config, setting))
        sensors = replace(world.sensors, position_std_m=0.5)
        config = replace(config, window=50, step=10, particles=20)
        like_nominal = varied._replace(
            world=world._replace(sensors=sensors), estimator=varied.estimator._replace(config=config, seed_shift=0)
        )
        assert like_nominal == nominal[method]
        changed = [world.sensors != sensors, varied.estimator.config != config, varied.estimator.seed_shift != 0]
        assert changed.count(True) <= 1


def test_the_sensitivity_table_says_where_the_papers_figure_is_met(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def computed(wanted: Iterable[tuple[Key, Trials]], _where: Running) -> dict[Key, Results]:
        """Errors of 1, 1.5, 10 ... %: rising with the noise."""
        scales = {0.05: 1.01, 0.1: 1.015}
        return {
            key: results([a_run(300.0, 100.0, scales.get(some.world.sensors.position_std_m, 1.1))[40:] for _ in STARTS])
            for key, some in wanted
        }

    monkeypatch.setattr(sensitivity, "grouped", computed)
    assert main(["sensitivity", "--runs", "1", "--json", str(tmp_path / "table.json")]) == 0
    assert "the paper's 1.87 % is met up to sigma = 0.1 m" in capsys.readouterr().out
    first = json.loads((tmp_path / "table.json").read_text())[0]
    assert (first["setting"], first["value"], first["method"]) == ("sigma_m", 0.05, "particle_em")
    assert first["mean_relative_error_percent"] == pytest.approx(1.0)
    monkeypatch.undo()
    assert main(["sensitivity", "--runs", "0"]) == 2

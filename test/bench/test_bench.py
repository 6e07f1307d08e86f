# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`bench`: the comparisons run, agree with exact smoothers and have the shape that others rely on. Nothing is timed."""

from __future__ import annotations

import gc
import json
import math
import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from conftest import SpinUntil
from rclpy.executors import Executor

from adhesion_node.bench import __main__ as bench
from adhesion_node.bench import against, growth, growth_figure, recording, scene, step, trains
from adhesion_node.bench.timing import Contender, figures, interleave

BRAKED = json.dumps([(k * 10**8, 5.0 * k, 0.25, 410e3 if k > 9 else 0.0) for k in range(100)])
"""Stamps, positions, their variance and brake pressures of 10 s, 9 of them braked."""


@pytest.fixture
def few_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """An estimator that has little to do: what it finds does not matter here."""
    monkeypatch.setattr(step, "CONFIG", replace(step.CONFIG, step=45, iterations=1))


def test_contenders_take_turns_after_a_warm_up() -> None:
    calls: list[str] = []

    def called(name: str) -> Contender[None]:
        return Contender(name, lambda: calls.append(name), {"a": 7, "b": 7, "slow": 2}[name])

    timed = interleave([called("a"), called("b"), called("slow")])
    assert calls[:3] == ["a", "b", "slow"]
    assert calls[3:] == ["a", "b", "slow", *["a", "b"] * 3, "a", "b", "slow", *["a", "b"] * 2]
    assert {name: len(runs.seconds) for name, runs in timed.items()} == {"a": 7, "b": 7, "slow": 2}
    assert all(seconds >= 0.0 for runs in timed.values() for seconds in runs.seconds)


def test_results_stand_beside_their_times() -> None:
    numbers: Iterator[int] = iter(range(10))
    timed = interleave([Contender("count", lambda: next(numbers), 4)])
    assert timed["count"].results == [1, 2, 3, 4]  # 0 was the warm-up


def test_figures_are_in_ms() -> None:
    found = figures([0.001] * 98 + [0.003, 0.009])
    assert found == {"calls": 100, "median_ms": 1.0, "p99_ms": pytest.approx(3.06), "max_ms": 9.0}


def test_a_window_is_drawn_from_the_model() -> None:
    motion, prior, window = scene.braking_window(400, np.random.default_rng(1))
    s, v, errors = *prior.mean, []
    for k in range(400):
        v, s = v - 0.1 * 9.8 * (scene.MU + float(motion.train.specific_resistance(np.asarray(v)))), s + 0.1 * v
        errors.append(window.position_m[k] - s)
    assert np.std(np.diff(errors)) == pytest.approx(math.sqrt(2.0) * scene.SIGMA_M, rel=0.15)
    assert abs(errors[49]) < 5.0


def test_a_journey_brakes_again_and_again_and_keeps_its_speed_in_bounds() -> None:
    pairs = list(islice(journey := scene.journey(10.0, np.random.default_rng(2)), 4000))
    assert next(journey)[0].t_ns == 400_000_000_000
    braked = np.array([pressure.pressure_pa > 0.0 for pressure, _ in pairs])
    position = np.array([sample.position_m for _, sample in pairs])
    assert np.count_nonzero(np.diff(braked.astype(int)) == 1) >= 3
    speed = (position[20:] - position[:-20]) / 2.0
    assert speed.min() > scene.SLOWEST_MPS - 2.0
    assert speed.max() < scene.FASTEST_MPS + 2.0
    acceleration = np.diff(speed[::20]) / 2.0
    assert acceleration[braked[20:-20][::20][: acceleration.size]].mean() < -0.6


@pytest.mark.usefixtures("few_windows")
def test_latency_is_that_of_steady_braking() -> None:
    row = step.latency(10.0, rounds=1, seed=1)
    assert 300 < row["calls"] < 600
    assert row["headroom"] == pytest.approx(row["samples_per_cpu_second"] / 10.0)
    assert row["core_percent"] == pytest.approx(100.0 / row["headroom"])
    assert row["cpu_p99_ms"] > 0.0
    assert 0.0 < row["median_ms"] <= row["p99_ms"] <= row["max_ms"]


@pytest.mark.usefixtures("few_windows")
def test_memory_is_read_while_the_estimator_runs() -> None:
    row = step.memory(1.0, 10.0, seed=1)
    assert row["windows"] >= 8
    assert row["growth_mb"] == pytest.approx(row["end_mb"] - row["filled_mb"])
    assert row["end_mb"] > 10.0


def test_a_recording_is_replayed_whole() -> None:
    row = recording.replay(0.02, 10.0, seed=1)
    assert row["positions"] == 720
    assert row["cpu_seconds_per_10h"] == pytest.approx(500.0 * row["cpu_seconds"])
    assert 0.0 < row["of_it_reading"] < 1.0


def test_a_recording_is_reported_with_its_results_and_without() -> None:
    results, sensors = recording.report(0.01, 10.0, seed=1)
    assert (results["holds"], sensors["holds"]) == ("results", "sensors")
    assert results["beside_estimating"] == results["cpu_seconds"] > 0.0
    assert 0.0 < sensors["beside_estimating"] < sensors["cpu_seconds"]
    assert min(results["peak_mb"], sensors["peak_mb"]) > 50.0


def test_what_grows_has_an_exponent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growth, "SECONDS", 3.0)
    monkeypatch.setattr(growth, "SIZES", {"trains": (1, 4), "hypotheses": (20, 40), "rate_hz": (5, 20)})
    rows = growth.compare(1, seed=1)
    assert [(row["grows"], row["size"]) for row in rows][:3] == [("trains", 1), ("trains", 4), ("hypotheses", 20)]
    assert rows[0]["exponent"] == rows[1]["exponent"]
    ms = {row["size"]: row["ms"] for row in rows if row["grows"] == "trains"}
    assert rows[0]["exponent"] == pytest.approx(math.log(ms[4] / ms[1]) / math.log(4.0))


def test_what_grows_is_drawn_with_its_exponent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growth, "SECONDS", 3.0)
    monkeypatch.setattr(growth, "SIZES", {name: sizes[:2] for name, sizes in growth.SIZES.items()})
    assert bench.main(["growth", "--figures", str(tmp_path), "--format", "svg", "--json", str(tmp_path / "rows")]) == 0
    drawn = (tmp_path / "growth.svg").read_text(encoding="utf-8")
    for row in json.loads((tmp_path / "rows").read_text(encoding="utf-8"))["growth"]["rows"]:
        assert f"{growth_figure.NAMES[row['grows']]}: {round(row['exponent'], 1) + 0.0:.1f}" in drawn


OTHER = """
from typing import NamedTuple
class Config: pass
class Measurement(NamedTuple):
    t_ns: int; position_m: float; variance_m2: float; brake_pressure_pa: float
def init(config, seed): return 0
def step(config, state, measurement): return state + 1, state % 2 or None
"""
"""An estimator of another tree: an estimate at every other measurement."""


def test_another_revision_follows_the_same_measurements(tmp_path: Path) -> None:
    _, braked, updates, estimates = against._followed(str(against.ROOT), BRAKED)
    assert (braked, updates) == (90, 90), "the bank is updated at every position"
    assert 17 <= estimates <= 19
    package = tmp_path / "adhesion_node"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "core.py").write_text(OTHER)
    assert against._followed(str(tmp_path), BRAKED)[1:] == [90, 45, 45], "a window with its estimates alone"
    (package / "core.py").write_text("raise ImportError('of long ago')")
    with pytest.raises(ValueError, match=r"does not run here: .*of long ago"):
        against._followed(str(tmp_path), BRAKED)


def test_resident_memory_grows_with_what_is_held() -> None:
    before = step.resident_mb()
    held = np.ones(8_000_000)  # more than an allocator keeps of what was freed
    assert step.resident_mb() - before == pytest.approx(held.nbytes / 2**20, abs=8.0)


@pytest.mark.parametrize("kind", trains.EXECUTORS)
def test_trains_of_one_process_are_all_served(
    kind: str, monkeypatch: pytest.MonkeyPatch, spin_until: SpinUntil
) -> None:
    """What has not been used at the end was on its way: it is used a little later."""
    monkeypatch.setattr(trains, "WARM_S", 0.5)
    measured, due_s = trains._measured, list[float]()

    def watched(executor: Executor, driver: Any, served: Any, seconds: float) -> dict[str, Any]:
        row = measured(executor, driver, served, seconds)
        sent = [{t_ns: at_s for t_ns, at_s in one.items() if at_s >= driver._begun_s} for one in driver.due_s]
        due_s.extend(sorted(at_s for stamps in sent for at_s in stamps.values()))
        pairs = list(zip(served, sent, strict=True))
        spin_until(executor, lambda: all(stamps.keys() <= train.used_s.keys() for train, stamps in pairs))
        return row

    monkeypatch.setattr(trains, "_measured", watched)
    row = trains.share(kind, count=3, rate_hz=10.0, seconds=1.0, seed=1)
    assert (row["executor"], row["trains"]) == (kind, 3)
    assert np.diff(due_s) == pytest.approx(1.0 / 30.0), "each train at 10 Hz, one after the other"
    assert 0 < row["calls"] <= row["calls"] + row["unused"] <= len(due_s), "without what came while they warmed up"
    assert 0.0 < row["median_ms"] <= row["p99_ms"]
    assert 0.0 < row["cores"] < (os.cpu_count() or 1)
    assert row["cpu_ms_per_position"] > 0.0
    assert 0.0 < row["cpu_p99_ms"] <= row["cpu_max_ms"]
    assert gc.get_freeze_count() == 0, "only while it measures"


@pytest.mark.usefixtures("few_windows")
def test_command_prints_a_table_and_json(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a journey of 28 s, 8 s of them braked."""
    monkeypatch.setattr(step, "journey", lambda rate_hz, rng: islice(scene.journey(rate_hz, rng), round(28 * rate_hz)))
    options = ["step", "memory", "--journeys", "1", "--minutes", "0.5"]
    assert bench.main([*options, "--json", "-"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert set(result) == {"versions", "seed", "step", "memory"}
    ways = [(row["rate_hz"], row["estimate_s"]) for row in result["step"]["rows"]]
    assert ways == [(10.0, 0.5), (100.0, 0.5), (10.0, 0.0), (100.0, 0.0)]
    assert all({"core_percent", "cpu_p99_ms", "p99_ms"} <= set(row) for row in result["step"]["rows"])
    assert result["versions"]["numpy"] == np.__version__
    assert bench.main(["memory", "--minutes", "0.2"]) == 0
    shown = capsys.readouterr().out
    assert f"numpy {np.__version__}" in shown
    assert "growth_mb" in shown
    assert "samples_per_cpu_second" not in shown


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["speed"], "choose of particle, gaussian, normal, step, memory, trains"),
        (["against"], "name the revision, --against REV"),
        (["--against", "no-such-revision"], "give a revision, and run bench in a clone"),
        (["recording", "--hours", "0"], "hours = 0"),
        (["--rounds", "0"], "rounds = 0"),
        (["memory", "--minutes", "inf"], "minutes = inf"),
        (["--seed", "-1"], "seed = -1"),
        (["step", "--hours", "3"], "--hours 3.0: is for recording and report: name one, or leave this out"),
        (["--against", "HEAD", "--rounds", "9"], "--rounds 9: is for particle and gaussian and normal: name one"),
        (["step", "--figures", "here"], "--figures here: is for growth: name one, or leave this out"),
        (["growth", "--width", "85"], "--width 85: nothing is drawn without --figures: add that, or leave this out"),
    ],
)
def test_bad_options_are_one_line_and_code_2(args: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert bench.main(args) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert said in err


def test_a_missing_peer_is_said_with_the_remedy(capsys: pytest.CaptureFixture[str]) -> None:
    with mock.patch.dict(sys.modules, {"particles": None}), mock.patch.object(bench, "find_spec", return_value=None):
        assert bench.main(["particle"]) == 2
    assert "particles" in (said := capsys.readouterr().err)
    assert "bench]'" in said

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The posterior Cramér-Rao bound against the information matrix of the whole trajectory, and the published table."""

from __future__ import annotations

import json
import math
import pathlib
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles import specific_resistance

from adhesion_node.core.config import Config
from adhesion_node.core.physics.adhesion import WET
from adhesion_node.study.__main__ import main
from adhesion_node.study.bound.cramer_rao import Bound, Path, Start, bound, speed_lost, std_that_stays_within

Array = NDArray[np.float64]
G, DT, FULL = 9.8, 0.1, 0.9332 / 9.8
Q = np.array([0.02, 0.02 / 3.6]) ** 2
NOMINAL = Config().motion
START = Start(0.5, 0.15 / 3.6, 0.6)


def wet(speed: float) -> float:
    return 0.04 + 13.7 / (120.0 + 3.6 * speed)


def moved(x: Array, brake: float) -> Array:
    """One step of (s, v, kappa); without brake the train holds its speed."""
    s, v, kappa = x
    slower = v - DT * G * (min(kappa * wet(v), brake) + float(specific_resistance(np.array(v)))) if brake else v
    return np.array([s + DT * (v + slower) / 2.0, slower])


def drive(speed: float, brakes: Sequence[float], kappa: float = 1.0) -> Array:
    """States (s, v, kappa) of a run without noise, shape (K + 1, 3)."""
    states = [np.array([0.0, speed, kappa])]
    for brake in brakes:
        states.append(np.array([*moved(states[-1], brake), kappa]))
    return np.array(states)


def path_of(runs: Sequence[Array], brakes: Sequence[float]) -> Path:
    states = np.array(runs, dtype=np.float64)
    times = np.linspace(0.0, len(brakes) * DT, len(brakes) + 1)
    return Path(times, states[..., 0], states[..., 1], np.array([*brakes, brakes[-1]]))


def dense(runs: Sequence[Array], brakes: Sequence[float], sigma: float, walk: float = 0.0) -> Array:
    """Covariance of the last (s, v, kappa): information of all states at once, inverted; kappa may walk per step.

    Jacobians by finite differences of `moved`; the information is the mean over the runs.
    """
    steps = len(brakes)
    kappas = steps + 1 if walk else 1
    size = 2 * (steps + 1) + kappas
    total = np.zeros((size, size))

    def add(indices: list[int], deviation: Array, precision: Array) -> None:
        total[np.ix_(indices, indices)] += deviation.T @ np.diag(precision) @ deviation

    kappa_at = [2 * (steps + 1) + (k if walk else 0) for k in range(steps + 1)]
    add([0, 1, kappa_at[0]], np.eye(3), np.array(START) ** -2.0)
    for k, brake in enumerate(brakes):
        for states in runs:
            h = 1e-5 * np.eye(3)
            a = np.array([(moved(states[k] + e, brake) - moved(states[k] - e, brake)) / 2e-5 for e in h]).T
            involved = [2 * k, 2 * k + 1, kappa_at[k], 2 * k + 2, 2 * k + 3]
            add(involved, np.hstack([a, -np.eye(2)]), 1.0 / Q / len(runs))
        if walk:
            add(kappa_at[k : k + 2], np.array([[1.0, -1.0]]), np.array([1.0 / walk]))
        add([2 * k + 2], np.eye(1), np.array([sigma**-2.0]))
    last = [2 * steps, 2 * steps + 1, kappa_at[-1]]
    return np.asarray(np.linalg.inv(total)[np.ix_(last, last)])


def last_covariance_agrees(found: Bound, covariance: Array, states: Array) -> None:
    stds = np.array([found.position_std_m[-1], found.speed_std_mps[-1], found.condition_std[-1]])
    np.testing.assert_allclose(stds, np.sqrt(np.diag(covariance)), rtol=1e-5)
    _, v, kappa = states[-1]
    slope = kappa * (wet(v + 1e-4) - wet(v - 1e-4)) / 2e-4
    gradient = np.array([0.0, slope, wet(v)])
    std = math.sqrt(gradient @ covariance @ gradient)
    assert found.mu_std[-1] == pytest.approx(std, rel=1e-5)
    assert found.mu_relative_std[-1] == pytest.approx(std / (kappa * wet(v)), rel=1e-5)


@pytest.mark.parametrize("kappa", [1.0, 0.6])
@pytest.mark.parametrize("sigma", [0.1, 2.0])
def test_bound_is_the_inverse_of_the_whole_trajectorys_information(kappa: float, sigma: float) -> None:
    brakes = [0.0] * 20 + [FULL] * 60
    states = drive(70.0, brakes, kappa)
    found = bound(NOMINAL, WET, path_of([states], brakes), sigma**2, START, condition=kappa)
    last_covariance_agrees(found, dense([states], brakes, sigma), states)


def test_the_expectation_is_over_the_trajectories() -> None:
    """One of the two runs is limited by the brake all the time."""
    brakes = [0.08] * 40
    runs = [drive(75.0, brakes), drive(40.0, brakes)]
    assert wet(40.0) > 0.08 > wet(70.0)
    covariance = dense(runs, brakes, 0.5)
    found = bound(NOMINAL, WET, path_of(runs, brakes), 0.25, START)
    np.testing.assert_allclose(found.condition_std[-1], math.sqrt(covariance[2, 2]), rtol=1e-5)
    alone = bound(NOMINAL, WET, path_of(runs[:1], brakes), 0.25, START)
    assert abs(found.condition_std[-1] / alone.condition_std[-1] - 1.0) > 0.3


@pytest.mark.parametrize(("speed", "brake"), [(30.0, FULL), (80.0, 0.05), (80.0, 0.0)])
def test_no_information_on_the_condition_where_the_brake_limits_or_is_off(speed: float, brake: float) -> None:
    brakes = [brake] * 30
    found = bound(NOMINAL, WET, path_of([drive(speed, brakes)], brakes), 0.25, START)
    np.testing.assert_allclose(found.condition_std, START.condition, rtol=1e-9)


PRINTED = {
    (0.5, 1.0): (18.1, 8.9, 5.1, 2.3, 1.0, 0.50),
    (0.5, 0.15): (8.5, 3.9, 2.5, 1.5, 0.84, 0.47),
    (0.1, 0.15): (4.5, 2.6, 1.8, 1.2, 0.75, 0.45),
    (2.0, 0.15): (26.7, 10.8, 5.6, 2.4, 1.1, 0.53),
}
"""Standard deviation of kappa in % after 10, 15, 20, 30, 50, 100 km/h of braking from 300, by sigma and known speed."""


@pytest.mark.parametrize(("known", "printed"), PRINTED.items())
def test_bound_over_the_run_is_the_one_known_before(known: tuple[float, float], printed: tuple[float, ...]) -> None:
    sigma, speed_kmh = known
    brakes = [FULL] * 360
    found = bound(
        NOMINAL, WET, path_of([drive(300 / 3.6, brakes)], brakes), sigma**2, Start(sigma, speed_kmh / 3.6, 0.6)
    )
    ours = 100.0 * np.interp(np.array([10, 15, 20, 30, 50, 100]) / 3.6, found.lost_mps, found.condition_std)
    # Printed with two digits, and with a prior of kappa that is not printed.
    np.testing.assert_allclose(ours, printed, rtol=0.04)


def test_speed_lost_is_that_after_which_the_bound_stays_low() -> None:
    std = np.array([9.0, 9.0, 4.0, 5.0, 3.0, 2.0])
    found = Bound(np.arange(6.0), np.array([0.0, 0.0, 1.0, 2.0, 3.0, 4.0]), std, std, std, std, std)
    assert speed_lost(found, 4.5) == 3.0
    assert speed_lost(found, 2.5) == 4.0
    assert speed_lost(found, 10.0) == 0.0
    assert speed_lost(found, 2.0) == math.inf


def optimal_errors(rng: np.random.Generator, runs: int) -> tuple[Array, Array]:
    """Errors of the best estimate of a constant from growing noisy data, (runs, K), and their standard deviation."""
    precision = 10.0 ** np.linspace(-2.0, 3.0, 4000)
    news = np.diff(precision, prepend=0.0)
    return np.cumsum(np.sqrt(news) * rng.standard_normal((runs, news.size)), axis=1) / precision, precision**-0.5


@pytest.mark.parametrize("share", [0.5, 0.95])
def test_errors_stay_within_from_that_std_on_in_that_share_of_runs(share: float) -> None:
    errors, std = optimal_errors(np.random.default_rng(3), 2000)
    since = int(np.argmax(std < std_that_stays_within(1.0, share)))
    kept = np.mean(np.all(np.abs(errors[:, since:]) < 1.0, axis=1))
    assert kept == pytest.approx(share, abs=4.0 * math.sqrt(share * (1 - share) / 2000) + 0.01)


def test_study_prints_and_writes_the_bound(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bound", "--json", "-"]) == 0
    table = json.loads(capsys.readouterr().out)
    assert main(["bound"]) == 0
    lines = capsys.readouterr().out.splitlines()[-len(table) :]
    for line, entry in zip(lines, table, strict=True):
        assert entry["scenario"] in line
        assert f"{entry['std_percent']['30']:.2f}" in line
        known = (entry["sigma_m"], entry["speed_std_kmh"])
        if known in PRINTED:
            np.testing.assert_allclose(list(entry["std_percent"].values()), PRINTED[known], rtol=0.05)
        lost = entry["lost_kmh"]
        assert 5 < lost["mean"] < lost["half"] < lost["most"] < 40
    by_case = {(entry["scenario"], entry["sigma_m"], entry["speed_std_kmh"]): entry for entry in table}
    # 20 s of cruising tell the speed to 0.15 km/h
    cruised, given = by_case["tunnel_entry", 0.5, None], by_case["tunnel_entry", 0.5, 0.15]
    assert cruised["lost_kmh"]["half"] == pytest.approx(given["lost_kmh"]["half"], rel=0.02)
    # sqrt(2/pi) times the mean standard deviation
    assert 0.40 < cruised["mean_error_percent"] < 0.55


def test_noise_of_the_runs_hardly_moves_the_bound() -> None:
    """The study takes the run without noise for the expectation over runs."""
    brakes = [FULL] * 200
    rng = np.random.default_rng(1)
    still = drive(300 / 3.6, brakes)
    runs = [still + np.cumsum(np.sqrt([*Q, 0.0]) * rng.standard_normal(still.shape), axis=0) for _ in range(30)]
    alone, together = (bound(NOMINAL, WET, path_of(paths, brakes), 0.25, START) for paths in ([still], runs))
    np.testing.assert_allclose(together.condition_std, alone.condition_std, rtol=3e-3)


def test_the_bound_is_drawn(tmp_path: pathlib.Path) -> None:
    assert main(["bound", "--figures", str(tmp_path), "--format", "svg"]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bound_tunnel_entry.svg", "bound_tunnel_exit.svg"]
    drawn = (tmp_path / "bound_tunnel_entry.svg").read_text(encoding="utf-8")
    for sigma in ("0.1", "0.5", "2"):
        assert f"positions with σ = {sigma} m" in drawn

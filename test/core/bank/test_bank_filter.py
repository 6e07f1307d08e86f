# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The bank on a rail of constant adhesion, against a Kalman filter of (s, v, mu) that shares no code with it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from banks import CONFIG, FULL, FULL_PA, S, bank_of, braked_run, measurements
from numpy_bank import position_seen
from oracles import specific_resistance

from adhesion_node.core.bank.findings.verdict import found
from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.free import closed
from adhesion_node.core.bank.labels.kinds import FREE, HELD, KINDS, SLIDES, STEADY
from adhesion_node.core.bank.labels.noises import LASTS
from adhesion_node.core.bank.layout import BRAKE, MU, POSITION, SIZE, SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.bank.motion import Braking, moved
from adhesion_node.core.bank.seeing import corrected
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.physics.train import Array

SURE = replace(CONFIG, resistance_std=0.0, brake_drift=0.0)
"""Nothing open of the resistance."""

UNKNOWN = Rail(0.06, 0.04, 0.02)


class Filtered(NamedTuple):
    mean: Array
    covariance: Array
    log_likelihood: float


def textbook(positions: Array, dt: float, start: Array, spread: Array, r: float, restless: float) -> Filtered:
    """Extended Kalman filter of (s, v, mu): Euler's speed, the trapezoid's position, analytic derivatives."""
    x, p, total = start.copy(), np.diag(spread**2), 0.0
    for index, position in enumerate(positions):
        if index:
            v = float(x[1])
            bend = float(specific_resistance(np.array(v + 1e-4)) - specific_resistance(np.array(v - 1e-4))) / 2e-4
            slower = v - dt * 9.8 * (x[2] + float(specific_resistance(np.array(v))))
            kept = 1.0 - dt * 9.8 * bend
            f = np.array([[1.0, dt * (1.0 + kept) / 2, -(dt**2) * 9.8 / 2], [0.0, kept, -dt * 9.8], [0.0, 0.0, 1.0]])
            drift = (KINDS[2].drift * x[2]) ** 2
            x = np.array([x[0] + dt * (v + slower) / 2, slower, x[2]])
            p = f @ p @ f.T + dt * np.diag([0.02**2 / 0.1, restless**2, drift])
        h = np.array([1.0, 0.0, 0.0])
        s = float(p[0, 0]) + r
        residual = float(position - x[0])
        total += -0.5 * (np.log(2.0 * np.pi * s) + residual**2 / s)
        k = p @ h / s
        x, p = x + k * residual, p - np.outer(k, k) * s
    return Filtered(x, p, total)


@pytest.mark.parametrize("seed", [0, 1, 3])  # no position so far off that it is clipped
def test_a_single_hypothesis_is_the_kalman_filter(seed: int) -> None:
    _, truth, positions = braked_run(0.05, seed, 25.0)
    positions, truth = positions[50:], truth[50:]  # from where the brake is applied
    start, spread = np.array([*truth[0] + (0.4, 0.3), 0.07]), np.array([1.0, 0.5, 0.03])
    # smooth rail, positions with white errors, no dependence on speed
    bank = bank_of([2], laws=[2], noises=[0])
    mean, covariance = np.zeros((1, SIZE)), np.zeros((1, SIZE, SIZE))
    mean[0, [POSITION, SPEED, MU]], mean[0, BRAKE] = start, 1.0
    for component, std in zip((POSITION, SPEED, MU), spread, strict=True):
        covariance[0, component, component] = std**2
    bank = bank._replace(mean=mean, covariance=covariance, log_weight=np.zeros(1))
    for index, position in enumerate(positions):
        if index:
            bank = moved(SURE, bank, 0.1, Braking(FULL), 0.3)
        bank = corrected(bank, position_seen(bank, float(position), 0.3))
    oracle = textbook(positions, 0.1, start, spread, 0.09, KINDS[2].restlessness_mps)
    three = [POSITION, SPEED, MU]
    assert bank.mean[0, three] == pytest.approx(oracle.mean, rel=1e-8)
    assert bank.covariance[0][np.ix_(three, three)] == pytest.approx(oracle.covariance, rel=1e-6, abs=1e-12)
    constants = 0.5 * positions.size * np.log(2.0 * np.pi)
    assert bank.log_weight[0] - constants == pytest.approx(oracle.log_likelihood, abs=1e-6)


def run(config: Config, seed: int, mu: float, seconds: float = 35.0) -> list[Memory]:
    times, _, positions = braked_run(mu, seed, seconds)
    memories: list[Memory] = []
    for each in measurements(times, positions, 0.3):
        memories.append(followed(config, memories[-1], each, lambda: UNKNOWN) if memories else met(config, each))
    return memories


@pytest.mark.parametrize(("seed", "mu"), [(0, 0.03), (1, 0.05), (2, 0.07)])
def test_the_whole_bank_finds_what_the_filter_finds_that_knows_all(seed: int, mu: float) -> None:
    _, truth, positions = braked_run(mu, seed, 35.0)
    memory = run(CONFIG, seed, mu)[-1]
    start, spread = np.array([*truth[50], 0.06]), np.array([1.0, 0.5, 0.04])
    oracle = textbook(positions[50:], 0.1, start, spread, 0.09, KINDS[2].restlessness_mps)
    mean, covariance = memory.bank.moments()
    assert memory.braked
    assert float(memory.bank.weight @ SLIDES[memory.bank.kind]) > 0.9
    assert abs(mean[MU] - mu) < 4.0 * np.sqrt(covariance[MU, MU])
    assert mean[SPEED] == pytest.approx(oracle.mean[1], abs=4.0 * np.sqrt(covariance[SPEED, SPEED]))
    assert mean[SPEED] == pytest.approx(truth[-1, 1], abs=4.0 * np.sqrt(covariance[SPEED, SPEED]))
    assert mean[MU] == pytest.approx(mu, rel=0.05)
    # who knows less is no surer than who knows all
    assert covariance[SPEED, SPEED] >= 0.8 * oracle.covariance[1, 1]


@pytest.mark.parametrize("seed", range(3))
def test_a_rail_that_gets_drier_is_followed(seed: int) -> None:
    """By 2.5 % a second: who takes it for steady is 15 % behind."""
    times, _, positions = braked_run(0.05, seed, 25.0, growth=0.025)
    config = replace(CONFIG, law_probability=0.3)
    memory: Memory | None = None
    for each in measurements(times, positions, 0.3):
        memory = followed(config, memory, each, lambda: UNKNOWN) if memory else met(config, each)
    assert memory is not None
    assert memory.bank.mean_of(MU) == pytest.approx(0.05 * np.exp(0.025 * 20.0), rel=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_the_bound_holds_on_a_rail_that_loses_adhesion(seed: int) -> None:
    """By 0.6 % a second, by positions of 2 m: who takes it for steady claims 8 % too much, and misses in a sixth."""
    times, _, positions = braked_run(0.07, seed, 45.0, std_m=2.0, growth=-0.006)
    config = replace(CONFIG, law_probability=0.3)
    memory, told = met(config, measurements(times[:1], positions[:1], 2.0)[0]), []
    for time, each in zip(times[1:], measurements(times[1:], positions[1:], 2.0), strict=True):
        memory = followed(config, memory, each, lambda: UNKNOWN)
        if time > 17.0:
            told.append((found(config, memory, UNKNOWN, UNKNOWN).rail, 0.07 * np.exp(-0.006 * (time - 5.0))))
    assert np.mean([rail.lower <= gives for rail, gives in told]) >= 0.95
    assert np.mean([rail.mu / gives - 1.0 for rail, gives in told]) < 0.06


def test_a_brake_that_the_rail_bears_is_found() -> None:
    memory = run(CONFIG, 4, 0.2, 25.0)[-1]
    assert float(memory.bank.weight @ (memory.bank.kind == HELD)) > 0.5
    mean, _ = memory.bank.moments()
    assert mean[BRAKE] == pytest.approx(1.0, abs=0.05)


def test_white_positions_are_told_from_wandering_ones() -> None:
    bank = run(CONFIG, 5, 0.05)[-1].bank
    assert float(bank.weight @ (bank.noise == 0)) > 0.9
    rng = np.random.default_rng(6)
    times, _, positions = braked_run(0.05, 6, 35.0, std_m=0.0)
    slow = np.zeros(times.size)
    kept = np.exp(-0.1 / 30.0)
    for index in range(1, times.size):
        slow[index] = kept * slow[index - 1] + 2.0 * np.sqrt(1 - kept**2) * rng.standard_normal()
    memory: Memory | None = None
    for each in measurements(times, positions + slow + 0.2 * rng.standard_normal(times.size), 2.0):
        memory = met(CONFIG, each) if memory is None else followed(CONFIG, memory, each, lambda: UNKNOWN)
    assert memory is not None
    assert float(memory.bank.weight @ (memory.bank.noise == 0)) < 0.01


@pytest.mark.parametrize("white_m", [0.05, 0.1, 0.12])
def test_a_receiver_that_wanders_slowly_is_known_as_one(white_m: float) -> None:
    """By 0.2 m in 10 s, of 2 m declared, as recorded ones. Taken for faster, it tells the speed half as surely."""
    rng = np.random.default_rng(8)
    times, truth, positions = braked_run(0.05, 8, 35.0, std_m=white_m)
    wandering = np.cumsum(rng.normal(0.0, 0.02, times.size))
    memory: Memory | None = None
    for each in measurements(times, positions + wandering, 2.0):
        memory = met(CONFIG, each) if memory is None else followed(CONFIG, memory, each, lambda: UNKNOWN)
    assert memory is not None
    assert float(memory.bank.weight @ (LASTS[memory.bank.noise] > 1000.0)) > 0.5
    mean, covariance = memory.bank.moments()
    assert np.sqrt(covariance[SPEED, SPEED]) < 0.1
    assert mean[SPEED] == pytest.approx(truth[-1, 1], abs=4.0 * np.sqrt(covariance[SPEED, SPEED]))


def test_a_released_brake_leaves_what_was_learnt_of_train_and_sensors() -> None:
    bank = run(CONFIG, 1, 0.05)[-1].bank
    free = closed(bank)
    assert set(free.kind) == {FREE, STEADY}
    for noise in np.unique(bank.noise):
        part, one = bank.part(bank.noise == noise), free.part(free.noise == noise)
        weight = part.weight / part.weight.sum()
        assert one.weight.sum() == pytest.approx(part.weight.sum(), rel=1e-9)
        assert one.mean[:, SPEED] == pytest.approx(float(weight @ part.mean[:, SPEED]), rel=1e-9)
        assert np.all(one.mean[:, MU] == 0.0)


@pytest.mark.parametrize("split", [1, 3, 10])
def test_pressures_in_any_split_over_measurements_give_the_same_state(split: int) -> None:
    """Ten pressures a second between positions once a second: in one measurement, or in several without position."""
    times, _, positions = braked_run(0.05, 3, 12.0)
    rng = np.random.default_rng(1)
    every = measurements(times, positions, 0.3, FULL_PA)
    memories = []
    for parts in (1, split):
        memory = met(CONFIG, every[0])
        for second in range(0, 110, 10):
            group = every[second + 1 : second + 11]
            cut = sorted(rng.choice(np.arange(1, 10), size=parts - 1, replace=False).tolist())
            for first, last in zip([0, *cut], [*cut, 10], strict=True):
                pressures = tuple(sample for each in group[first:last] for sample in each.pressures)
                newest = group[last - 1]
                measured = newest._replace(pressures=pressures)
                if last < 10:
                    measured = measured._replace(variance_m2=float("inf"))
                memory = followed(CONFIG, memory, measured, lambda: UNKNOWN)
        memories.append(memory)
    one, other = memories
    assert one.brake == other.brake
    assert one.t_ns == other.t_ns == S + round(11.0 * S)
    assert one.braked
    assert other.braked

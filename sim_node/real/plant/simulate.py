# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The runs of a scenario: rails under the wheels, demand, protection and motion, period by period."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from . import creep, motion, protection, train, way
from .journey import GRAVITY, PERIOD_S, Array, Journey
from .scenarios import Scenario
from .way import Ground

STEP_S = 0.005
STANDING_PERIODS = round(4.0 / PERIOD_S)
"""The run ends so long after the stop."""

LONGEST_S = 900.0
PITCH_RADPS, PITCH_DAMPING = 2.0 * np.pi * 0.9, 0.3
"""Own frequency of a body on its secondary springs."""


class _Log(NamedTuple):
    """One sample of R runs."""

    position: Array
    speed: Array
    rim: Array
    used: Array
    pressure: Array


def simulate(scenario: Scenario, seeds: Sequence[int], step_s: float = STEP_S) -> tuple[Journey, ...]:
    """Run the scenario once for every seed. `step_s` divides `PERIOD_S`.

    Raises ValueError when a train does not stop within the way or `LONGEST_S`.
    """
    rngs = [np.random.default_rng(seed) for seed in seeds]
    trains = train.stack([train.draw(scenario.nominal, scenario.scatter, rng) for rng in rngs])
    nominal = scenario.nominal
    ways = [way.draw(scenario.rail, scenario.grade, nominal.length_m, scenario.way_m, rng) for rng in rngs]
    logs = _run(scenario, trains, ways, round(PERIOD_S / step_s))
    return tuple(_journey(scenario, seed, trains, ways[i], logs, i) for i, seed in enumerate(seeds))


def demanded_pa(scenario: Scenario, time_s: Array | float) -> Array:
    """Return the gauge pressure that is asked for."""
    starts, shares = np.array([(-np.inf, 0.0), *scenario.demands]).T
    return np.asarray(shares[np.searchsorted(starts, time_s, side="right") - 1] * scenario.nominal.full_pa)


def _run(scenario: Scenario, trains: train.Train, ways: list[way.Way], substeps: int) -> _Log:
    """Return the samples of all runs, stacked along a first axis of time."""
    nominal, dt, runs = scenario.nominal, PERIOD_S / substeps, len(ways)
    ground, cylinders = Ground(ways, scenario.rail, scenario.nominal), protection.Cylinders(nominal, trains, dt)
    delays = nominal.offsets() / nominal.propagation_mps
    weight = trains.mass_kg * GRAVITY
    still, rolling = np.zeros((runs, 1)), np.full((runs, nominal.groups), scenario.speed_mps)
    now = motion.Motion(still, rolling[:, :1], rolling)
    control, told = protection.start(rolling), [np.zeros(rolling.shape, dtype=np.intp)] * 8
    lags = [int(np.ceil((protection.DEAD_S - k * dt) / PERIOD_S - 1e-9)) for k in range(substeps)]
    samples, standing = [_Log(*now, still, cylinders.pressure_pa)], 0
    while standing <= STANDING_PERIODS:
        time = (len(samples) - 1) * PERIOD_S
        if time > LONGEST_S or now.position_m.max() > scenario.way_m - 1.0:
            raise ValueError(f"scenario {scenario.name}: no stop within {scenario.way_m:g} m and {LONGEST_S:g} s")
        rail, hill = ground.contact(now.position_m), weight * ground.grade(now.position_m)
        if nominal.slide_protection:
            control, valves = protection.command(control, now.rim_mps, nominal.protection_creep)
            told = [valves, *told[:-1]]
        asked = demanded_pa(scenario, time - delays)
        impulse = still
        for lag in lags:
            brake = train.brake_n(trains, cylinders.step(asked, told[lag]), now.rim_mps)
            running = train.resistance_n(nominal, trains, now.speed_mps) + hill
            if time < scenario.demands[0][0]:  # traction keeps the speed
                running = still
            now, force = motion.step(now, trains, rail, brake, running, dt)
            impulse = impulse + force
        samples.append(_Log(*now, impulse / (substeps * weight), cylinders.pressure_pa))
        standing += not now.speed_mps.any()
    return _Log(*(np.array(values) for values in zip(*samples, strict=True)))


def _journey(scenario: Scenario, seed: int, trains: train.Train, drawn: way.Way, logs: _Log, run: int) -> Journey:
    """Cut one run out of the samples, and add what follows from it."""
    ground = Ground([drawn], scenario.rail, scenario.nominal)
    stop = int(np.argmax(logs.speed[:, run, 0] <= 0.0)) + STANDING_PERIODS
    position, speed, used = (values[: stop + 1, run] for values in (logs.position, logs.speed, logs.used))
    rim, cylinder = logs.rim[: stop + 1, run], logs.pressure[: stop + 1, run]
    peak, best = creep.peak(speed, ground.contact(position))
    beyond = speed - rim > np.minimum(best, creep.SLIDING) * np.maximum(speed, creep.CREEPING_MPS)
    time = np.asarray(np.arange(stop + 1) * PERIOD_S, dtype=np.float64)
    radius = trains.radius_m[run]
    return Journey(
        seed=seed,
        time_s=time,
        position_m=position[:, 0],
        speed_mps=speed[:, 0],
        acceleration_mps2=np.diff(speed[:, 0], prepend=speed[0, 0]) / PERIOD_S,
        grade=ground.grade(position)[:, 0],
        used=used[:, 0],
        available=peak.mean(axis=1),
        sliding=beyond.mean(axis=1),
        demanded_pa=demanded_pa(scenario, time),
        cylinder_pa=cylinder,
        wheel_radps=rim / radius,
        pitch_rad=pitch(used[:, 0] * GRAVITY * trains.pitch_rad_per_mps2[run]),
        full_from_s=scenario.demands[-1][0],
        radius_m=radius,
    )


def pitch(rest_rad: Array) -> Array:
    """Return how a body follows the pitch at which it would rest: a damped oscillator, samples every `PERIOD_S`."""
    from scipy.signal import cont2discrete, lfilter  # loads slowly, as `way` says

    w, z = PITCH_RADPS, PITCH_DAMPING
    numerator, denominator, _ = cont2discrete(([w * w], [1.0, 2.0 * z * w, w * w]), PERIOD_S)
    return np.asarray(lfilter(numerator.ravel(), denominator, rest_rad))

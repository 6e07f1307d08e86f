# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How a recorded train slows down, over what is believed: where it coasts, and where it brakes on a dry rail."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ...core import Config, PositionSample, PressureSample, SpeedSample
from ...core.physics.train import GRAVITY, Array
from ...run.offline import Recorded
from ...run.reader import Reader
from ...wire.line import Line
from ...wire.messages.refused import Rejected
from ...wire.topics import ADHESION_INPUTS
from .found import BRAKE_S, COAST_S, Found, Ratio

RELEASED_S = 5.0
"""So long behind the last pressure the blocks and pads are off."""

STEADY, LEAST = 0.1, 0.1
"""By how much the pressure of a stretch may vary, and how high it must be, as a share of the full one."""

COASTS = (0.3, 3.0)
"""Between these shares of the believed resistance a train without brake coasts; else its traction is at work."""

STICKS = 0.85
"""A stretch whose brake gives less than this share of the best quarter slid, or its pressure told too much."""

SURE = 0.3
"""Standard error of a stretch's ratio above which it says nothing."""

FEW = 2
"""Stretches from which a mean has a scatter."""


class Log(NamedTuple):
    """What was measured: times, s, and values; arrays of shape (n, 2)."""

    positions: Array
    speeds: Array
    pressures: Array


def read(recorded: Iterable[Recorded], line: Line) -> Log:
    """Collect positions, speeds and gauge pressures; what is refused is left out."""
    reader = Reader(ADHESION_INPUTS, line)
    topics = {topic.name: topic for topic in reader.inputs}
    rows: dict[type, list[tuple[int, float]]] = {PositionSample: [], SpeedSample: [], PressureSample: []}
    for name, message, _ in recorded:
        if isinstance(message, Rejected) or name not in topics:
            continue
        try:
            sample = reader.read(topics[name], message)
        except Rejected:
            continue
        if isinstance(sample, PositionSample | SpeedSample | PressureSample) and sample.is_valid():
            rows[type(sample)].append((sample[0], sample[1]))
    first = min((each[0][0] for each in rows.values() if each), default=0)
    return Log(*(np.array(sorted({((t - first) * 1e-9, x) for t, x in each})).reshape(-1, 2) for each in rows.values()))


def find(config: Config, log: Log) -> Found:
    """Compare how the train slows down with what is believed of it. Raises ValueError without pressures."""
    if not log.pressures.size:
        why = "without which brake and coasting look alike; a demand does not tell what the cylinders get"
        raise ValueError(f"the recording holds no brake_pressure, {why}: record it, or import_csv --pressure COL")
    coasting = list(_coasting(config, log))
    coasts = [one for one in coasting if COASTS[0] < one[0] < COASTS[1]]
    resistance = _mean(coasts, len(coasting) - len(coasts))
    brakes = list(_braking(config, log, 1.0 if resistance is None else resistance.mean))
    best = np.quantile([ratio for ratio, _ in brakes], 0.75) if brakes else 0.0
    sticks = [one for one in brakes if one[0] >= STICKS * best]
    return Found(config, resistance, _mean(sticks, len(brakes) - len(sticks)))


def _mean(ratios: list[tuple[float, float]], left_out: int) -> Ratio | None:
    """Mean of ratios with standard errors, by their weights; its own error also by their scatter."""
    if not ratios:
        return None
    values, errors = np.array(ratios).T
    weights = 1.0 / (errors**2 + 0.02**2)  # no stretch is known better: grades, wind, pads
    mean = float(np.average(values, weights=weights))
    scatter = np.average((values - mean) ** 2, weights=weights) / (values.size - 1) if values.size >= FEW else 0.0
    return Ratio(mean, float(np.sqrt(max(1.0 / weights.sum(), scatter))), values.size, left_out)


def _coasting(config: Config, log: Log) -> Iterator[tuple[float, float]]:
    """Resistance over the believed one, of stretches without brake, with standard errors."""
    t, pressure = log.pressures.T
    pressed = t[pressure >= config.least_pressure_pa]
    for start in np.arange(t[0], t[-1] - COAST_S, COAST_S):
        if ((pressed > start - RELEASED_S) & (pressed < start + COAST_S)).any():
            continue
        for slowing, error, speed, grade in _slowing(config, log, start, COAST_S, braked=False):
            believed = float(config.train.specific_resistance(np.array(speed)))
            rotating = (1.0 + config.train.rotating_mass_fraction) / GRAVITY
            if error * rotating / believed < SURE:
                yield (slowing * rotating - grade) / believed, error * rotating / believed


def _braking(config: Config, log: Log, resistance: float) -> Iterator[tuple[float, float]]:
    """Brake force over the believed one, of stretches at steady pressure, with standard errors."""
    train = config.train
    t, pressure = log.pressures.T
    for start in np.arange(t[0], t[-1] - BRAKE_S, BRAKE_S / 2):
        within = pressure[(t >= start) & (t <= start + BRAKE_S)]
        if (
            within.size < 2
            or np.ptp(within) > STEADY * train.full_pressure_pa
            or within.min() < LEAST * train.full_pressure_pa
        ):
            continue
        for slowing, error, speed, grade in _slowing(config, log, start, BRAKE_S, braked=True):
            believed = float(train.specific_brake(float(within.mean())))
            rotating = (1.0 + train.rotating_mass_fraction) / GRAVITY
            resisting = resistance * float(train.specific_resistance(np.array(speed))) + grade
            if error * rotating / believed < SURE:
                yield (slowing * rotating - resisting) / believed, error * rotating / believed


def _slowing(
    config: Config, log: Log, start_s: float, length_s: float, braked: bool
) -> Iterator[tuple[float, float, float, float]]:
    """Yield deceleration, its standard error, speed and grade of a stretch, by positions or speeds, or nothing.

    The better of both counts. Deceleration and grade are along the train's way, whichever end of the track it runs to.
    """
    axle = braked and config.speed_source == "axle"
    fits = [_fitted(log.positions, start_s, length_s, 2)] + (
        [] if axle else [_fitted(log.speeds, start_s, length_s, 1)]
    )
    sure = [fit for fit in fits if fit is not None]
    if not sure:
        return
    acceleration, error, speed = min(sure, key=lambda fit: fit[1])
    if abs(speed) < config.slowest_mps:
        return
    sign = 1.0 if speed > 0.0 else -1.0
    place = log.positions[np.abs(log.positions[:, 0] - start_s - length_s / 2) <= length_s / 2, 1]
    grade = sign * float(config.track.specific_resistance(place).mean()) if place.size else 0.0
    yield -sign * acceleration, error, abs(speed), grade


def _fitted(rows: Array, start_s: float, length_s: float, degree: int) -> tuple[float, float, float] | None:
    """Acceleration, its standard error and the mean speed, by a polynomial through positions (2) or speeds (1)."""
    t, x = rows[(rows[:, 0] >= start_s) & (rows[:, 0] <= start_s + length_s)].T
    if t.size < 2 * (degree + 1) or np.ptp(t) < 0.8 * length_s:
        return None
    centred = t - t.mean()
    (highest, *rest), covariance = np.polyfit(centred, x - x.mean(), degree, cov=True)
    speed = float(rest[0]) if degree == 2 else float(x.mean())
    return degree * float(highest), degree * float(np.sqrt(covariance[0, 0])), speed

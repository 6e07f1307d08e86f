# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Adhesion that is used, and the prediction over a step, one hypothesis after the other."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

Array = NDArray[np.float64]
Labels = NDArray[np.intp]
Mask = NDArray[np.bool_]
Columns = tuple[Array, Array, Array, Labels, Labels, Labels, Array, Array]
"""A bank as a plain tuple, as the next two are: one with names takes numba 20 times as long to look at."""
ModelNumbers = tuple[
    float, Array, Array, Array, Array, Array, Array, Array, float, Array, float, Array, Array, float, float, float
]
StepNumbers = tuple[float, float, float, bool, float, float, bool, float]

GRAVITY = 9.8
LEAST_MU = 0.03
"""Adhesion drifts in proportion to itself, from this on: else one that was believed to be 0 would stay so."""
LEAST_MPS = 0.1
"""What fades along the way fades as if the train were so fast at least: it may be, where it is believed to stand."""
BEARS = 1.5
"""Times as much as the sliding axles those that roll may use, on rail that is cleaned before them. One that is pressed
with more and rolls is isolated, or its protection has let go of it."""
BUILDING_UP, FILLING = 0.3, 0.2
"""Error of the brake's force, relative. While it is applied harder: of the speed over 1 s, and as an accelerometer
feels it. While cylinders fill, over what they will press with, as how they fill nobody tells: of the speed over 1 s; an
accelerometer feels it by the first, as it lasts."""
OPENS, OPEN = 0.1, 0.5
"""Standard deviation per root of a second of the brake's force where it is more than the known brake can give: another
one is at work, which no gauge shows, and nothing is known of that. It grows to this at most, as at a standstill."""
POSITION, SPEED, MU, ROUGH, BRAKE, GRADE, OFFSET, BIAS, RADIUS, SIZE = 0, 1, 2, 3, 4, 5, 6, 7, 10, 11


class Model(NamedTuple):
    """Train, track and what the labels of the hypotheses mean, as numbers."""

    rotating: float
    resistance: Array
    """Of the speed in m/s: c0, c1, c2, N/N."""
    breaks: Array
    """Where the track's profile changes, m."""
    levels: Array
    """Its resistance before, between and behind them, N/N."""
    laws: Array
    """floor, gain, offset, scale of each law, shape (L, 4)."""
    kinds: Array
    """Whether it slides, drift, roughness, restlessness, growth of each kind, shape (K, 5)."""
    noises: Array
    """White part, least white one, slow part, least slow one, time that lasts, shape (N, 5)."""
    fading: Array
    """How fast the roughness of each kind fades, per m and per s, shape (K, 2)."""
    grade_m: float
    """Correlation length of the grade."""
    free: Array
    """How long the net deceleration of each kind lasts that no brake holds, s, and what it is at most over g, shape
    (K, 2); 0 s: brake or rail hold it."""
    free_std: float
    """Its standard deviation over g."""
    rates: Array
    """Variances per second of position, brake, bias and radius."""
    unlearnt: Array
    """Variances of brake and radius before anything is learnt of them, to which a drift leads."""
    grade_error: float
    resistance_error: float
    strongest: float
    """Part of the expected brake force beyond which another brake is at work."""


class Step(NamedTuple):
    """A step in time, and the brake over it."""

    dt_s: float
    applied: float
    share: float
    rising: bool
    told: float
    filling: float
    alone: bool
    declared_m: float


@kernel
def _basic(model: Model, v: float) -> float:
    c = model.resistance
    return float(c[0] + v * (c[1] + c[2] * v))


@kernel
def _resistance(model: Model, s: float, v: float) -> float:
    section = np.searchsorted(model.breaks, s, side="right")
    return float(_basic(model, v) + model.levels[section])


@kernel
def _law(model: Model, law: int, v: float) -> float:
    row = model.laws[law]
    return float(row[3] * (row[0] + row[1] / (row[2] + max(v, 0.0) * 3.6)))


@kernel
def _used(
    model: Model, x: Array, kind: int, resisting: float, step: Step
) -> tuple[float, bool, float, float, float, float]:
    """u, whether the adhesion limits, and du/d(mu, rho, beta, v)."""
    if model.free[kind, 0] > 0.0:
        most = model.free[kind, 1]
        return min(x[MU], most), False, 1.0 if x[MU] < most else 0.0, 0.0, 0.0, 0.0
    rotating = model.rotating
    needed = (x[BRAKE] * step.applied - rotating * resisting) / (1.0 + rotating)
    rail = x[MU] * (1.0 + x[ROUGH])
    slides = model.kinds[kind, 0] > 0.0 and (rail < needed or step.told > 0.0)
    f = step.share if slides else 0.0
    if slides and needed > BEARS * rail:
        whole = f + (1.0 - f) * BEARS
        return whole * rail, slides, whole * (1.0 + x[ROUGH]), whole * x[MU], 0.0, 0.0
    held = (1.0 - f) / (1.0 + rotating)
    by_speed = -held * rotating * (model.resistance[1] + 2.0 * model.resistance[2] * x[SPEED])
    return f * rail + (1.0 - f) * needed, slides, f * (1.0 + x[ROUGH]), f * x[MU], held * step.applied, by_speed


@kernel
def _drifted(variance: float, drift: float, most: float) -> float:
    """Variance that a drift by so much adds, less the nearer it is to the most, to which it tends."""
    return -max(most - variance, 0.0) * math.expm1(-drift / most)


@kernel
def _opened(model: Model, step: Step, brake: float, variance: float) -> float:
    """Variance that a step adds to the brake's force: it drifts, or is another one's, by how well it is known.

    Where a gauge is alone another brake is a hypothesis of its own.
    """
    drifted = _drifted(variance, step.dt_s * model.rates[1], model.unlearnt[0])
    stronger = brake > model.strongest and step.applied > 0.0 and not step.alone
    return drifted + step.dt_s * OPENS**2 if stronger and variance < OPEN**2 else drifted


@kernel
def used(
    model_numbers: ModelNumbers, bank: Columns, resisting: Array, step_numbers: StepNumbers
) -> tuple[Array, Array, Mask]:
    """Adhesion used, shape (H,), its derivatives, shape (H, SIZE), and whether the adhesion limits, shape (H,)."""
    model, step = Model(*model_numbers), Step(*step_numbers)
    count, mean, kind = resisting.size, bank[0], bank[5]
    value, slope, slides = np.empty(count), np.zeros((count, SIZE)), np.empty(count, dtype=np.bool_)
    for h in range(count):
        u = _used(model, mean[h], kind[h], resisting[h], step)
        value[h], slides[h] = u[0], u[1]
        slope[h, MU], slope[h, ROUGH], slope[h, BRAKE], slope[h, SPEED] = u[2], u[3], u[4], u[5]
    return value, slope, slides


@kernel
def moved(model_numbers: ModelNumbers, bank: Columns, step_numbers: StepNumbers) -> tuple[Array, Array]:
    """Means and covariances after a step: x' = f(x), P' = F P F^T + Q.

    F is diagonal, what lasts of each component, but for the rows of speed and position.
    """
    model, step = Model(*model_numbers), Step(*step_numbers)
    dt, (mean, covariance, _, noise, law, kind, _, _) = step.dt_s, bank
    means, covariances = np.empty_like(mean), np.empty_like(covariance)
    lasting, added = np.ones(SIZE), np.zeros(SIZE)
    fall, by_fall, by_way = np.zeros(SIZE), np.empty(SIZE), np.empty(SIZE)
    added[POSITION], added[BIAS] = dt * model.rates[0], dt * model.rates[2]
    for h in range(kind.size):
        x, p, k = mean[h], covariance[h], kind[h]
        v, n = x[SPEED], model.noises[noise[h]]
        resisting, basic = _resistance(model, x[POSITION], v), _basic(model, v)
        u, _, by_mu, by_rough, by_brake, by_speed = _used(model, x, k, resisting, step)
        slower = v - dt * GRAVITY * (u + resisting + x[GRADE])
        way_m = max(v, LEAST_MPS) * dt
        if model.free[k, 0] > 0.0:
            lasting[MU] = math.exp(-dt / model.free[k, 0])
            added[MU] = model.free_std**2 * (1.0 - lasting[MU] ** 2)
        else:
            bent = _law(model, law[h], slower) / _law(model, law[h], v)
            lasting[MU] = bent * math.exp(model.kinds[k, 4] * dt) if model.kinds[k, 0] > 0.0 else 1.0
            added[MU] = (model.kinds[k, 1] * max(x[MU], LEAST_MU)) ** 2 * dt
        lasting[ROUGH] = math.exp(-way_m * model.fading[k, 0] - dt * model.fading[k, 1])
        lasting[GRADE], lasting[OFFSET] = math.exp(-way_m / model.grade_m), math.exp(-dt / n[4])
        rising = BUILDING_UP * GRAVITY * u if step.rising else 0.0
        filling = FILLING * GRAVITY * x[BRAKE] * step.filling if by_brake > 0.0 else 0.0
        added[SPEED] = (model.kinds[k, 3] ** 2 + rising**2 + filling**2) * dt
        added[ROUGH] = model.kinds[k, 2] ** 2 * (1.0 - lasting[ROUGH] ** 2)
        added[BRAKE] = _opened(model, step, x[BRAKE], p[BRAKE, BRAKE])
        added[RADIUS] = _drifted(p[RADIUS, RADIUS], dt * model.rates[3], model.unlearnt[1])
        added[GRADE] = (model.grade_error**2 + (model.resistance_error * basic) ** 2) * (1.0 - lasting[GRADE] ** 2)
        added[OFFSET] = max(n[2] * step.declared_m, n[3]) ** 2 * (1.0 - lasting[OFFSET] ** 2)
        for i in range(SIZE):
            means[h, i] = lasting[i] * x[i]
        means[h, SPEED], means[h, POSITION] = slower, x[POSITION] + 0.5 * dt * (v + slower)
        # rows of F: v' = v - dt g (u + r + gamma), s' = s + dt (v + v')/2
        by_speed += model.resistance[1] + 2.0 * model.resistance[2] * v
        pull = -dt * GRAVITY
        fall[MU], fall[ROUGH], fall[BRAKE], fall[GRADE] = pull * by_mu, pull * by_rough, pull * by_brake, pull
        fall[SPEED] = 1.0 + pull * by_speed
        for i in range(SIZE):
            by_fall[i] = p[SPEED, i] * fall[SPEED] + p[MU, i] * fall[MU] + p[ROUGH, i] * fall[ROUGH]
            by_fall[i] += p[BRAKE, i] * fall[BRAKE]
            by_fall[i] += p[GRADE, i] * fall[GRADE]
        fall_fall, way_fall, way_way = 0.0, 0.0, 0.0
        for i in range(SIZE):
            by_way[i] = p[POSITION, i] + 0.5 * dt * (p[SPEED, i] + by_fall[i])
            fall_fall += fall[i] * by_fall[i]
            way_fall += fall[i] * by_way[i]
        way_way = by_way[POSITION] + 0.5 * dt * (by_way[SPEED] + way_fall)
        for i in range(SIZE):
            for j in range(SIZE):
                covariances[h, i, j] = lasting[i] * lasting[j] * p[i, j]
        for i in range(SIZE):
            covariances[h, SPEED, i] = covariances[h, i, SPEED] = lasting[i] * by_fall[i]
            covariances[h, POSITION, i] = covariances[h, i, POSITION] = lasting[i] * by_way[i]
        covariances[h, SPEED, SPEED], covariances[h, POSITION, POSITION] = fall_fall, way_way
        covariances[h, POSITION, SPEED] = covariances[h, SPEED, POSITION] = way_fall
        for i in range(SIZE):
            covariances[h, i, i] += added[i]
    return means, covariances


@kernel
def foreseen(
    model_numbers: ModelNumbers, bank: Columns, step_numbers: StepNumbers, position_m: float, white: Array
) -> tuple[Array, Array, float, float, float]:
    """Means and covariances after a step, and how far a position lies off what they foresee.

    That is the mean innovation, its standard deviation over all hypotheses, and the least one in its own. `white` is
    the variance, m^2, of the position's white error by the label `noise`.
    """
    means, covariances = moved(model_numbers, bank, step_numbers)
    log_weight, noise = bank[2], bank[3]
    metres, spread, nearest, innovation = 0.0, 0.0, np.inf, np.empty(noise.size)
    for h in range(noise.size):
        innovation[h] = position_m - (means[h, POSITION] + means[h, OFFSET])
        metres += math.exp(log_weight[h]) * innovation[h]
    for h in range(noise.size):
        p = covariances[h]
        each = p[POSITION, POSITION] + p[POSITION, OFFSET] + p[OFFSET, POSITION] + p[OFFSET, OFFSET] + white[noise[h]]
        nearest = min(nearest, abs(innovation[h]) / math.sqrt(each))
        spread += math.exp(log_weight[h]) * (each + (innovation[h] - metres) ** 2)
    # NaN where any number has failed
    return means, covariances, metres, math.sqrt(spread), nearest + 0.0 * spread

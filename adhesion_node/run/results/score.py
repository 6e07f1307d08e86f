# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How good the estimates of a run are against the simulator's truth."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...core import Config
from ...core.physics.train import GRAVITY, KMH, Array, Train
from .used import averaged

CONVERGED_AFTER_MPS = 30.0 * KMH
"""Speed lost under the brake after which the paper's estimates count as converged."""


LESS, LEAST_LESS = 0.15, 0.01
"""A train that uses so much less than the true adhesion, as a part of it and at least, is limited by its brake: what a
grade or an error of the believed resistance does is less."""


SMOOTH_S = 2.0
"""The motion of a simulated train is noisy, too."""

AFTER_SHARE = 0.25
"""Part of its first speed that a real train loses before its estimates count, where 30 km/h is more."""

SLOWEST_MPS = 3.0
"""Until a real train is down to it, its estimates count."""


class Identified(Protocol):
    """An adhesion and its time: an estimate, or what a recording holds of one."""

    @property
    def t_ns(self) -> int: ...

    @property
    def mu(self) -> float: ...


class Point(NamedTuple):
    """An adhesion and its time, alone."""

    t_ns: int
    mu: float


@dataclass
class Truth:
    """True adhesion and speed, and the measured brake pressure, by stamp."""

    mu: dict[int, float] = field(default_factory=dict)
    speed_mps: dict[int, float] = field(default_factory=dict)
    pressure_pa: dict[int, float] = field(default_factory=dict)
    """Gauge."""
    limited: dict[int, bool] = field(default_factory=dict)
    """Of a real train, whether adhesion limited it; `mu` is then what it used."""

    def limits(self, config: Config, t_ns: int) -> bool:
        """Whether the true adhesion, not the brake, limited the train at a time."""
        mu, speed, pressure = self.mu.get(t_ns), self.speed_mps.get(t_ns), self.pressure_pa.get(t_ns)
        if mu is None or speed is None or pressure is None:
            return False
        resistance = config.train.specific_resistance(np.asarray(speed))
        return bool(config.train.used_adhesion(mu, config.brake(pressure), resistance) == mu)

    def used(self, train: Train) -> dict[int, float]:
        """What the train made use of, as its true speed fell over `SMOOTH_S`, by stamp; empty of less than two."""
        if len(self.speed_mps) < 2:
            return {}
        stamps = sorted(self.speed_mps)
        speeds = np.array([self.speed_mps[t_ns] for t_ns in stamps])
        time_s = 1e-9 * (np.array(stamps) - stamps[0])
        early, late = (np.clip(time_s + by, 0.0, time_s[-1]) for by in (-SMOOTH_S / 2, SMOOTH_S / 2))
        slows = (np.interp(early, time_s, speeds) - np.interp(late, time_s, speeds)) / (late - early)
        return dict(zip(stamps, (slows / GRAVITY - train.specific_resistance(speeds)).tolist(), strict=True))

    def converged_speed(self, config: Config) -> float:
        """Speed, m/s, below which estimates count: that of the first braking less 30 km/h."""
        braked = (t_ns for t_ns, pressure in self.pressure_pa.items() if config.brake(pressure) > 0.0)
        return self.speed_mps.get(min(braked, default=-1), 0.0) - CONVERGED_AFTER_MPS


def mean_relative_error_percent(config: Config, truth: Truth, estimates: Iterable[Identified]) -> float | None:
    """Mean of abs(mu - true mu)/true mu in % over all estimates while adhesion limits, after the first 30 km/h.

    Every estimate counts, whatever regime it claims; none where the train in truth uses less, as by worn pads. None
    where there is no truth to compare with. Of a real train see `_of_real_train`.
    """
    if truth.limited:
        return _of_real_train(truth, estimates)
    slow_enough, used = truth.converged_speed(config), truth.used(config.train)
    errors = [
        abs(estimate.mu - truth.mu[estimate.t_ns]) / truth.mu[estimate.t_ns]
        for estimate in estimates
        if truth.limits(config, estimate.t_ns)
        and truth.speed_mps.get(estimate.t_ns, np.inf) < slow_enough
        and truth.mu[estimate.t_ns] - used.get(estimate.t_ns, np.inf) < max(LESS * truth.mu[estimate.t_ns], LEAST_LESS)
    ]
    return 100.0 * float(np.mean(errors)) if errors else None


def _of_real_train(truth: Truth, estimates: Iterable[Identified]) -> float | None:
    """The same by the mean over a second of what a real train used, whatever the stamps, as `study real` has it.

    A quarter of the speed is enough where that is less than 30 km/h; a train slower than 3 m/s does not count.
    """
    points = [(estimate.t_ns, estimate.mu) for estimate in estimates]
    if not (points and truth.mu and truth.speed_mps):
        return None
    t_ns, mu = np.array([t_ns for t_ns, _ in points]), np.array([mu for _, mu in points])
    (mu_ns, used), (speed_ns, speed), (limited_ns, limited) = (
        _by_time(values) for values in (truth.mu, truth.speed_mps, truth.limited)
    )
    true, now = np.interp(t_ns, mu_ns, averaged(mu_ns, used)), np.interp(t_ns, speed_ns, np.abs(speed))
    before = np.interp(t_ns, speed_ns, np.maximum.accumulate(np.abs(speed)))
    limits = np.interp(t_ns, limited_ns, limited, left=0.0, right=0.0) == 1.0
    counts = limits & (now > SLOWEST_MPS) & (now < before - np.minimum(CONVERGED_AFTER_MPS, AFTER_SHARE * before))
    return 100.0 * float(np.mean(np.abs(mu[counts] / true[counts] - 1.0))) if counts.any() else None


def _by_time(values: Mapping[int, float]) -> tuple[NDArray[np.int64], Array]:
    """Times and values in the order of time."""
    t_ns = np.array(sorted(values), dtype=np.int64)
    return t_ns, np.array([values[one] for one in t_ns.tolist()], dtype=np.float64)

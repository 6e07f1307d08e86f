# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How good the estimates of a run are against the simulator's truth."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from ...core import Config
from ...core.physics.train import GRAVITY, KMH, Train

CONVERGED_AFTER_MPS = 30.0 * KMH
"""Speed lost under the brake after which the paper's estimates count as converged."""


LESS, LEAST_LESS = 0.15, 0.01
"""A train that uses so much less than the true adhesion, as a part of it and at least, is limited by its brake: what a
grade or an error of the believed resistance does is less."""


SMOOTH_S = 2.0
"""The motion of a simulated train is noisy, too."""


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
    where there is no truth to compare with.
    """
    slow_enough, used = truth.converged_speed(config), truth.used(config.train)
    errors = [
        abs(estimate.mu - truth.mu[estimate.t_ns]) / truth.mu[estimate.t_ns]
        for estimate in estimates
        if truth.limits(config, estimate.t_ns)
        and truth.speed_mps.get(estimate.t_ns, np.inf) < slow_enough
        and truth.mu[estimate.t_ns] - used.get(estimate.t_ns, np.inf) < max(LESS * truth.mu[estimate.t_ns], LEAST_LESS)
    ]
    return 100.0 * float(np.mean(errors)) if errors else None

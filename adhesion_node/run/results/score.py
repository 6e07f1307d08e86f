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
from ...core.physics.train import KMH

CONVERGED_AFTER_MPS = 30.0 * KMH
"""Speed lost under the brake after which the paper's estimates count as converged."""


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

    def converged_speed(self, config: Config) -> float:
        """Speed, m/s, below which estimates count: that of the first braking less 30 km/h."""
        braked = (t_ns for t_ns, pressure in self.pressure_pa.items() if config.brake(pressure) > 0.0)
        return self.speed_mps.get(min(braked, default=-1), 0.0) - CONVERGED_AFTER_MPS


def mean_relative_error_percent(config: Config, truth: Truth, estimates: Iterable[Identified]) -> float | None:
    """Mean of abs(mu - true mu)/true mu in % over all estimates while adhesion limits, after the first 30 km/h.

    Every estimate counts, whatever regime it claims. None where there is no truth to compare with.
    """
    slow_enough = truth.converged_speed(config)
    errors = [
        abs(estimate.mu - truth.mu[estimate.t_ns]) / truth.mu[estimate.t_ns]
        for estimate in estimates
        if truth.limits(config, estimate.t_ns) and truth.speed_mps.get(estimate.t_ns, np.inf) < slow_enough
    ]
    return 100.0 * float(np.mean(errors)) if errors else None

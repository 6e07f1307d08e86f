# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What every sensor is, and noise that several share."""

from typing import NamedTuple, Protocol

import numpy as np

from adhesion_node.wire.topic import Topic

from ..plant.journey import Array, Journey
from ..plant.train import Nominal


class Measured(NamedTuple):
    """What a sensor shows at N moments."""

    values: Array
    """Shape (N, K), in the unit of its topic; NaN where one of several has nothing to show."""
    variance: Array
    """What the sensor declares, shape (N,); 0: unknown."""


class Ride(NamedTuple):
    """What there is to measure."""

    journey: Journey
    nominal: Nominal
    """What the train's papers say, as a device is set up by it."""

    def at(self, time_s: Array, series: Array) -> Array:
        """One of the journey's series, (T,), at N moments."""
        return np.interp(time_s, self.journey.time_s, series)


class Sensor(Protocol):
    """A sensor by its settings."""

    @property
    def topic(self) -> Topic:
        """Where it publishes."""

    def measure(self, ride: Ride, time_s: Array, rng: np.random.Generator) -> Measured:
        """Measure at N increasing moments of the journey, s."""


def wander(time_s: Array, std: float, correlation_s: float, rng: np.random.Generator) -> Array:
    """A Gauss-Markov process of first order at N moments a constant period apart; stationary, shape (N,).

    x(k+1) = a x(k) + std sqrt(1 - a^2) n(k) with a = exp(-period/correlation time).
    """
    from scipy.signal import lfilter  # loads slowly, as `plant.way` says

    keeps = np.exp(-np.diff(time_s[:2]) / correlation_s)[0] if time_s.size > 1 else 0.0
    shocks = rng.standard_normal(time_s.size) * np.sqrt(1.0 - keeps**2)
    shocks[:1] /= np.sqrt(1.0 - keeps**2)
    result: Array = std * lfilter([1.0], [1.0, -keeps], shocks)
    return result


def one(values: Array, variance: float | Array) -> Measured:
    """One value of each moment, shape (N,), and its declared variance."""
    return Measured(values[:, np.newaxis], np.broadcast_to(np.asarray(variance, dtype=np.float64), values.shape))

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How soon after a fall of the rail its sensors could tell a train the adhesion that it uses, whatever the estimator.

The Cramer-Rao bound of an easier task: the deceleration steps once, at a known moment, and is constant before and
behind it; train and grade are known. Unknown are place and speed there, both decelerations, and what the sensors do not
tell of themselves. J = sum D' C^-1 D over the sensors, with the derivatives D of what each shows and the covariance C
of its errors, white and Gauss-Markov. The true train passes a border in seconds, which only takes longer.
"""

from bisect import bisect_left
from functools import lru_cache

import numpy as np

from sim_node.real.sensors.fitted import FITTED, Mounted
from sim_node.real.sensors.imu import Imu
from sim_node.real.sensors.position import Gnss, GnssFix
from sim_node.real.sensors.speed import Speedometer
from sim_node.real.sensors.wheels import Wheels

from ....core.physics.train import GRAVITY, Array

BEFORE_S = 10.0
"""What is used of the time before the step; more of it changes the second decimal."""

LONGEST_S, STEP_S = 20.0, 0.1


@lru_cache
def soonest_s(fitted: str, used: float, share: float) -> float | None:
    """Time, s, after which the standard deviation of the adhesion `used` may be a `share` of it.

    None: above 20 s; or not told, as wheels tell of the speed, too, and none of this is known of them.
    """
    mounted = FITTED[fitted].sensors.values()
    if any(isinstance(one.sensor, Wheels) for one in mounted):
        return None

    def told(after_s: float) -> bool:
        parts = [part for one in mounted if (part := _information(one, after_s)) is not None]
        return bool(parts) and deceleration_std(parts) <= share * used * GRAVITY

    times = np.arange(STEP_S, LONGEST_S, STEP_S)
    first = bisect_left(times, True, key=told)  # what is told once is not forgotten
    return round(float(times[first]), 1) if first < times.size else None


def deceleration_std(parts: list[Array]) -> float:
    """Standard deviation of the deceleration behind the step, m/s^2, by all sensors' information, (4, 4) each."""
    information = np.sum(parts, axis=0) + 1e-12 * np.eye(4)
    behind = np.array([0.0, 0.0, 1.0, 1.0])
    return float(np.sqrt(behind @ np.linalg.solve(information, behind)))


def _information(mounted: Mounted, after_s: float) -> Array | None:
    """Information about place, speed, deceleration before the step and its change; None: says nothing of them."""
    sensor = mounted.sensor.gnss if isinstance(mounted.sensor, GnssFix) else mounted.sensor
    t = np.arange(-BEFORE_S, after_s, 1.0 / mounted.timing.rate_hz)
    late, one = np.maximum(t, 0.0), np.ones_like(t)
    apart = np.abs(t[:, np.newaxis] - t)
    if isinstance(sensor, Gnss):
        shown = np.stack([one, t, t**2 / 2, late**2 / 2], axis=1)
        errors = sensor.white_std_m**2 * np.eye(t.size)
        errors += sensor.correlated_std_m**2 * np.exp(-apart / sensor.correlation_s)
    elif isinstance(sensor, Speedometer):
        shown = np.stack([0.0 * t, one, t, late], axis=1)
        errors = sensor.white_std_mps**2 * np.eye(t.size)
        errors += sensor.correlated_std_mps**2 * np.exp(-apart / sensor.correlation_s)
    elif isinstance(sensor, Imu):
        shown = np.stack([0.0 * t, 0.0 * t, one, (t > 0.0).astype(np.float64)], axis=1)
        errors = sensor.white_std_mps2**2 * np.eye(t.size) + sensor.bias_std_mps2**2
    else:
        return None
    return np.asarray(shown.T @ np.linalg.solve(errors, shown))

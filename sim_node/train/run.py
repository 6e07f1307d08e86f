# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One simulated run: the true train and what its sensors show, from one seed."""

from collections.abc import Iterator

import numpy as np

from .plant import NOMINAL_NOISE, PlantNoise, Truth, simulate
from .scenario import Scenario
from .sensors import Reading, SensorSettings, measure, wheel_speeds


def run(
    scenario: Scenario,
    period_s: float,
    seed: int,
    settings: SensorSettings | None = None,
    noise: PlantNoise = NOMINAL_NOISE,
) -> Iterator[tuple[Truth, Reading]]:
    """Yield the truth and the reading of every sample; the node publishes exactly these.

    The plant, the sensors and the wheels draw from separate streams of `seed` (at least 0), so that the true run does
    not depend on the sensors' settings. Raises ValueError as `simulate`.
    """
    plant_rng, sensor_rng, wheel_rng = (np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(3))
    used = settings or SensorSettings()
    wheel_std, radius_m = used.wheel_speed_std_radps, scenario.train.wheel_radius_m

    def read(truth: Truth) -> Reading:
        reading = measure(truth, used, sensor_rng)
        if not wheel_std:
            return reading
        return reading._replace(wheel_radps=wheel_speeds(truth, radius_m, wheel_std, wheel_rng))

    return ((truth, read(truth)) for truth in simulate(scenario, period_s, plant_rng, noise))

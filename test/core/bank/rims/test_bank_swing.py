# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is used swings within a second by more than is counted on, as where slide protection lets go of whole bogies."""

from __future__ import annotations

import numpy as np
import pytest
from banks import braked_run, measurements
from oracles import specific_resistance

from adhesion_node.core import Config, SpeedSample, init, step
from adhesion_node.core.physics.track import Grade, Track


@pytest.mark.parametrize("seed", range(4))
def test_the_bound_lies_below_what_swings_three_times_as_much(seed: int) -> None:
    """With a Doppler speed; below what is used in the second around."""
    times, truth, places = braked_run(0.05, seed, 45.0, swing=0.08)
    shown = truth[:, 1] + 0.05 * np.random.default_rng(seed + 100).standard_normal(times.size)
    told, held = Config(speed_source="doppler", track=Track((Grade(0.0, 1e4, 0.0),))), list[bool]()
    state = init(told, 1)
    for index, each in enumerate(measurements(times, places, 0.3)):
        doppler = SpeedSample(each.t_ns, float(shown[index]), 0.05**2)
        state, now = step(told, state, each._replace(speeds=(doppler,)))
        if now is not None and 10.0 < times[index] < 44.0:
            slowed = (truth[index - 5, 1] - truth[index + 5, 1]) / 9.8
            held.append(now.mu_lower <= slowed - float(specific_resistance(truth[index, 1])))
    assert len(held) > 50
    assert np.mean(held) >= 0.95

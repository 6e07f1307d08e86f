# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A grade that no profile tells."""

from __future__ import annotations

import numpy as np
import pytest
from banks import S, braked_run, measurements

from adhesion_node.core import Config, SpeedSample, init, step


@pytest.mark.parametrize("grade", [-0.01, 0.01])
@pytest.mark.parametrize("seed", range(3))
def test_a_steady_one_of_ten_permille_stays_within_what_is_told(grade: float, seed: int) -> None:
    """On wet rail, with a Doppler speed; what the train slows by is all that is seen."""
    mu, told = 0.06, Config(speed_source="doppler")
    times, truth, places = braked_run(mu + grade, seed, 30.0)
    shown = truth[:, 1] + 0.05 * np.random.default_rng(seed + 100).standard_normal(times.size)
    state, held = init(told, 1), list[bool]()
    for each, v in zip(measurements(times, places, 0.3), shown, strict=True):
        state, now = step(told, state, each._replace(speeds=(SpeedSample(each.t_ns, float(v), 0.05**2),)))
        if now is not None and now.t_ns > 15 * S:
            assert not now.withheld
            held.append(abs(now.mu - mu) <= 1.96 * now.mu_std and now.mu_lower <= mu)
    assert len(held) > 20
    assert np.mean(held) >= 0.95

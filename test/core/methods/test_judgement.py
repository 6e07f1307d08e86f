# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a window shows: the adhesion or the brake limits, or neither can be told; and what the wheels say of it."""

import math

import numpy as np
import pytest

from adhesion_node.core import Config, Regime
from adhesion_node.core.belief.rail import Identification, Rail
from adhesion_node.core.belief.window import WindowSample
from adhesion_node.core.methods.particle_em.method import judge
from adhesion_node.core.methods.protocol import Context
from adhesion_node.core.methods.rail_condition.judgement import most_used

CONFIG = Config(sliding_creep=0.04, creep_samples=5)
BRAKE, MU = 0.1, 0.07


def used(creeps: list[float]) -> float:
    """Of a train at 40 m/s whose median wheel creeps so, NaN where none was measured; the brake has built up."""
    brakes = np.linspace(0.5 * BRAKE, BRAKE, len(creeps)).tolist()
    samples = [
        WindowSample(k, brake, 0.0, 1.0, 40.0, math.inf, 40.0 * (1.0 - creep))
        for k, (brake, creep) in enumerate(zip(brakes, creeps, strict=True))
    ]
    return most_used(CONFIG, samples, np.full(len(creeps), 40.0), MU)


@pytest.mark.parametrize(
    ("creep", "most"),
    [(-0.03, MU), (0.0, MU), (0.019, MU), (0.021, BRAKE), (0.039, BRAKE), (0.041, math.inf), (1.0, math.inf)],
)
def test_rolling_wheels_show_the_brake_and_sliding_ones_the_rail(creep: float, most: float) -> None:
    """Between a half of what counts as sliding and the whole neither is known: the pressure alone tells."""
    assert used([creep] * 7) == most


def test_the_newest_wheels_count_by_their_median() -> None:
    assert used([0.3] * 10 + [0.0] * 5) == MU, "long ago they slid"
    assert used([0.0] * 10 + [0.3] * 5) == math.inf
    assert used([0.0, 0.3, 0.3, 0.0, 0.0]) == MU, "a passing slide of some"


def test_where_no_wheel_is_measured_the_pressure_tells() -> None:
    assert used([math.nan] * 5) == BRAKE
    assert used([math.nan, math.nan, 0.3, math.nan, math.nan]) == math.inf


BEFORE = Rail(0.08, 0.04, 0.03)


def judged(limit: float, mu: float = MU, kept: float = 0.0, measured: bool = True) -> tuple[Regime, Rail]:
    """Of a window of `particle_em` that gave so much, to 0.002, while the brake could use `limit`."""
    context = Context(BEFORE, None, measured, 0.0, np.random.default_rng(0))
    return judge(CONFIG, Identification(mu, 0.002, 0.08, kept), limit, context)


def test_the_rail_limits_where_the_brake_could_use_more() -> None:
    regime, rail = judged(limit=0.1)
    assert regime is Regime.ADHESION_LIMITED
    assert rail.mu == pytest.approx(MU, abs=0.001)
    assert judged(limit=0.07)[0] is Regime.BRAKE_LIMITED
    assert judged(limit=0.05)[0] is Regime.BRAKE_LIMITED


def test_at_the_brakes_limit_a_rail_bears_no_less_than_was_known() -> None:
    assert judged(limit=0.07)[1].lower >= BEFORE.lower


def test_what_the_start_alone_gave_shows_nothing() -> None:
    assert judged(limit=0.1, kept=0.9)[0] is Regime.COASTING


def test_without_a_pressure_a_deceleration_within_its_error_is_no_brake() -> None:
    assert judged(limit=0.1, mu=0.001, measured=False) == (Regime.COASTING, BEFORE)
    assert judged(limit=0.1, measured=False)[0] is Regime.ADHESION_LIMITED

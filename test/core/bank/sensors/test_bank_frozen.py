# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A receiver repeats the last place that it knew, as in the hall of a station, while the train departs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from banks import CONFIG, FULL_PA, S
from oracles import specific_resistance

from adhesion_node.core import Estimate, Measurement, Outcome, SpeedSample, WheelSample, init, step

DOPPLER = replace(CONFIG, speed_source="doppler")

H, DEPARTS_S, CRUISES_S, BRAKES_S = 0.1, 20.0, 60.0, 80.0


def journey(mu: float = 0.05) -> Iterator[tuple[float, float, float]]:
    """Time, place and speed: it stands, gains 0.5 m/s^2 up to 20 m/s, holds them, and brakes."""
    s, v, t = 0.0, 0.0, 0.0
    while t < BRAKES_S + 20.0:
        yield t, s, v
        slowing = 9.8 * (mu + float(specific_resistance(np.array(v))))
        faster = 0.5 if DEPARTS_S <= t < CRUISES_S else -slowing if t >= BRAKES_S else 0.0
        s, v, t = s + H * v, max(v + H * faster, 0.0), t + H


def followed(sensor: str, until_s: float, seed: int) -> tuple[dict[Outcome, int], list[tuple[float, Estimate]]]:
    """Counts, and the true speed beside every estimate; every second axle slides by 15 % under the brake."""
    rng, state, rows = np.random.default_rng(seed), init(DOPPLER, 1), []
    for t, s, v in journey():
        t_ns, braked = S + round(t * S), t < DEPARTS_S or t >= BRAKES_S
        position = 0.0 if t < until_s else s + 0.1 * rng.standard_normal()
        measurement = Measurement(t_ns, position, 4.0, FULL_PA if braked else 0.0)
        if sensor == "wheels":
            slides = 0.15 if t > BRAKES_S + 1.0 else 0.0
            rims = [v * (1.0 - slides * (axle % 2)) * (1.0 + 0.001 * rng.standard_normal()) for axle in range(8)]
            turns = tuple(rim / CONFIG.train.wheel_radius_m for rim in rims)
            measurement = measurement._replace(wheels=(WheelSample(t_ns, turns),))
        else:
            speed = SpeedSample(t_ns, v + 0.05 * rng.standard_normal(), 0.05**2)
            measurement = measurement._replace(speeds=(speed,))
        state, estimate = step(DOPPLER, state, measurement)
        rows += [] if estimate is None else [(v, estimate)]
    return dict(state.counts), rows


@pytest.mark.parametrize("sensor", ["wheels", "speed"])
@pytest.mark.parametrize("until_s", [55.0, math.inf])
@pytest.mark.parametrize("seed", range(2))
def test_wheels_or_a_speed_tell_that_the_train_has_departed(seed: int, until_s: float, sensor: str) -> None:
    """Wheels are no sooner believed than at 5 m/s; the way that they must have rolled takes 2 s more."""
    counts, rows = followed(sensor, until_s, seed)
    assert counts[Outcome.STUCK] > 20
    assert counts[Outcome.SLIDING] == counts[Outcome.RESET] == 0
    from_s = DEPARTS_S + 13.0 if sensor == "wheels" else 2.0
    known = [(v, each) for v, each in rows if (each.t_ns - S) / S > from_s]
    assert all(abs(each.speed_mps - v) < 4.0 * each.speed_std_mps + 0.2 for v, each in known)
    assert not any(each.withheld for _, each in known)
    assert max(b.t_ns - a.t_ns for (_, a), (_, b) in pairwise(rows)) < 0.7 * S

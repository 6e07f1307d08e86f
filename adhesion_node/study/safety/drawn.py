# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Cases that are drawn: a train on its way towards a target, the settings of its monitor, and no message yet."""

from __future__ import annotations

import numpy as np

from ...core.atp.config import SupervisionConfig
from ...core.atp.monitor import TICKS
from .case import LEAST_MPS, Case, Noise, Rng
from .truth import Brake, Train, allowed

ROUNDING_M = 0.01
"""Of ways of up to 100 km."""

WORST = (-1.0, -1.0)
"""States as far behind the train, and as slow, as they may be."""


def often(rng: Rng) -> bool:
    """Three times in four: what is worst, so that the monitor is tried where it has nothing to spare."""
    return bool(rng.integers(4))


def draw(rng: Rng) -> Case:
    """A train on its way towards a target, and its settings; no message yet."""
    warning_s = rng.uniform(0.0, 3.0)
    margins = bool(rng.integers(2))
    config = SupervisionConfig(
        target_position_m=0.0,
        target_speed_kmh=float(rng.choice([0.0, 40.0, 100.0, 160.0])),
        line_speed_kmh=500.0,
        emergency_build_up_s=rng.uniform(0.0, 5.0),
        service_build_up_s=rng.uniform(0.0, 5.0),
        traction_cut_off_s=rng.uniform(0.0, 10.0),
        warning_time_s=warning_s,
        driver_time_s=warning_s + rng.uniform(0.0, 3.0),
        acceleration_mps2=rng.uniform(0.0, 1.0),
        speed_margin_mps=0.5 if margins else 0.0,
        position_margin_m=5.0 if margins else 0.0,
        margin_sigma=rng.uniform(1.0, 4.0),
        valid_for_s=rng.uniform(0.5, 3.0),
        max_ahead_s=float(rng.choice([0.0, 0.1, 0.3])),
    )
    least = allowed(config.target_speed_mps) + LEAST_MPS
    speed_mps = rng.uniform(max(least, 12.0), 97.0) if often(rng) else rng.uniform(least, least + 12.0)
    standing_mps2, fading_mps = rng.uniform(0.2, 1.6), float(rng.choice([20.0, 60.0, 1e9, -300.0]))
    knee_mps = speed_mps * rng.choice([rng.uniform(0.0, 1.0), rng.uniform(0.94, 1.02)])
    most_mps2 = 10.0 if rng.integers(2) else standing_mps2 / (1.0 + knee_mps / fading_mps)
    train = Train(
        speed_mps,
        config.acceleration_mps2 * (1.0 if often(rng) else rng.uniform(-0.3, 1.0)),
        Brake(config.traction_s, config.coasting_s, standing_mps2, fading_mps, most_mps2, config.acceleration_mps2),
    )
    period_s, onset_s, check_s = rng.uniform(0.2, 0.8), rng.uniform(0.5, 1.5), rng.uniform(0.1, 0.3)
    stated_s = TICKS * check_s + config.max_ahead_s
    end_s = onset_s + stated_s + 0.5
    return Case(
        config,
        check_s,
        rng.uniform(0.5, 2.0),
        train,
        Noise(10.0 ** rng.uniform(-1.0, 1.25), 10.0 ** rng.uniform(-1.3, 0.3), WORST if often(rng) else None),
        1.0 if often(rng) else rng.uniform(0.7, 1.0),
        64 if often(rng) else round(2.0 * 10.0 ** rng.uniform(0.0, 2.0)),
        0.0 if often(rng) else rng.uniform(0.0, 1.0) * config.target_speed_mps,
        tuple(np.arange(0.0, end_s, period_s).tolist()),
        onset_s,
        end_s,
        stated_s,
        ROUNDING_M,
        (),
    ).placed(train)

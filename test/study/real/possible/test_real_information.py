# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How soon a fall of the rail can be told at all."""

from __future__ import annotations

import numpy as np
import pytest

from adhesion_node.study.real.possible.information import BEFORE_S, _information, deceleration_std, soonest_s
from sim_node.real.sensors.fitted import Mounted
from sim_node.real.sensors.position import Gnss
from sim_node.real.sensors.timing import Timing


def test_the_bound_is_the_spread_of_least_squares_on_white_positions() -> None:
    part = _information(Mounted(Gnss(correlated_std_m=0.0, white_std_m=0.5), Timing(), "one"), 3.0)
    assert part is not None
    t = np.arange(-BEFORE_S, 3.0, 0.1)
    design = np.stack([np.ones_like(t), t, t**2 / 2, np.where(t > 0, t**2 / 2, 0.0)], axis=1)
    noise = 0.5 * np.random.default_rng(1).standard_normal((t.size, 4000))
    fitted = np.linalg.lstsq(design, noise, rcond=None)[0]
    assert deceleration_std([part]) == pytest.approx((fitted[2] + fitted[3]).std(), rel=0.05)


def test_a_speed_tells_sooner_than_positions_and_an_accelerometer_soonest() -> None:
    positions, speed, felt = (soonest_s(name, 0.04, 0.2) for name in ("gnss", "gnss_doppler", "gnss_imu"))
    assert positions is not None
    assert speed is not None
    assert felt is not None
    assert felt < speed < 1.0 < positions
    assert soonest_s("gnss_wheels", 0.04, 0.2) is None  # the fastest rim bounds the speed


def test_what_no_sensor_tells_in_time_has_no_bound() -> None:
    assert soonest_s("tacho", 0.04, 0.2) is None
    assert soonest_s("gnss", 0.04, 0.001) is None

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""An accelerometer that lies askew, or with gravity on its axis: left out, and the train met anew."""

from __future__ import annotations

import pytest
from test_bank_trust import DRY, WET, assert_known, run

from adhesion_node.core import Outcome


@pytest.mark.parametrize("bias_mps2", [-9.81, -2.5, -1.4, 1.4, 2.5, 9.81])
@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
def test_an_accelerometer_that_is_askew_is_left_out(mu: float, bias_mps2: float) -> None:
    """By 8 degrees, 15, or standing on its head."""
    found = run(mu, 1, imu=(1.0, 0.05), bias_mps2=bias_mps2)
    counts = found.state.counts
    assert counts[Outcome.ASKEW] + counts[Outcome.TURNED] > 180
    assert counts[Outcome.SLIDING] == 0
    assert counts[Outcome.RESET] <= 2
    assert_known(found, mu, 12.0, 25.0)


def test_what_is_believed_with_it_is_given_up_once_and_said() -> None:
    found = run(WET, 1, imu=(1.0, 0.05), bias_mps2=-2.5)
    assert found.state.counts[Outcome.RESET] == 1
    assert "left out until the train is met anew" in str(found.state.events[-1])
    assert found.state.events[-1].detail.startswith("acceleration x = -3")

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is said of a train without new positions."""

import numpy as np
import pytest

from adhesion_node.core import Config, Estimate, Regime
from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.estimate import Knowledge, blind_estimate
from adhesion_node.core.intake.plausibility import STRONGEST_MPS2
from adhesion_node.core.methods.protocol import Fit, Verdict
from adhesion_node.core.physics.adhesion import SNOW

S = 10**9
SEEN = Estimate(5 * S, 0.08, 0.004, 0.07, Regime.ADHESION_LIMITED, 1000.0, 40.0, 1.5, 0.2, changes=2, window=7, ess=9.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_unseen_a_train_is_where_its_speed_brings_it_and_less_sure_by_all_that_it_may_brake(sign: float) -> None:
    blind = blind_estimate(Config(), SEEN._replace(speed_mps=sign * 40.0), 7 * S)
    assert (blind.t_ns, blind.speed_mps) == (7 * S, sign * 40.0)
    assert blind.position_m == pytest.approx(1000.0 + sign * 80.0)
    assert blind.speed_std_mps == pytest.approx(0.2 + 2.0 * STRONGEST_MPS2)
    assert blind.position_std_m == pytest.approx(1.5 + 2.0 * STRONGEST_MPS2)  # a t²/2 of 2 s


@pytest.mark.parametrize("method", ["bank", "rail_condition"])
def test_unseen_nothing_of_what_was_identified_is_said_any_more(method: str) -> None:
    blind = blind_estimate(Config(method=method), SEEN, 7 * S)
    assert (blind.withheld, blind.regime, blind.ahead) == (True, Regime.COASTING, None)
    assert (blind.window, blind.iterations, blind.changes) == (0, 0, 2)
    assert blind.mu == pytest.approx(float(SNOW(np.array(40.0))), rel=0.01)
    assert 0.0 < blind.mu_lower <= blind.mu < SEEN.mu
    assert blind.mu_std > SEEN.mu_std


def test_windows_are_numbered_on_and_one_without_measurements_is_none() -> None:
    """By its number each has random numbers of its own."""
    belief = Gaussian(np.array([900.0, 30.0]), np.eye(2))
    seen = Verdict(Regime.ADHESION_LIMITED, Rail(0.07, 0.01, 0.06), belief, None, 0.07, True, Fit(window=20))
    first = Knowledge().after(S, seen)
    nothing = first.after(2 * S, seen._replace(mu=None, changed=False, fit=Fit()))
    assert [each.windows for each in (first, nothing, nothing.after(3 * S, seen))] == [1, 1, 2]
    assert (nothing.mu, nothing.changes, nothing.t_ns, nothing.position_m) == (0.07, 1, 2 * S, 900.0)

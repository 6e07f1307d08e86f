# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train whose positions are given up is followed without them, and its curve holds until it stands."""

from __future__ import annotations

import numpy as np
import pytest
from banks import CONFIG, FULL_PA, S, bank_of
from oracles import specific_resistance

from adhesion_node.core import Measurement, Outcome, init, predict, step
from adhesion_node.core.bank.blind import REACH, STANDS_MPS, forwards
from adhesion_node.core.bank.labels.kinds import STEADY
from adhesion_node.core.bank.layout import MU, SPEED

BRAKE_S, H = 10.0, 0.1


@pytest.mark.parametrize("mu", [0.025, 0.03, 0.08])
@pytest.mark.parametrize("seed", range(3))
def test_the_curve_holds_until_a_train_stands_whose_wheel_slid_from_the_start(mu: float, seed: int) -> None:
    """From 25 m/s, the positions those of an axle that slides by a third; what remains is known when it stands."""
    rng, state, rows = np.random.default_rng(seed), init(CONFIG, 1), []
    speed, way, wheel, index = 25.0, 0.0, 0.0, 0
    while speed > 0.0:
        braked = index * H >= BRAKE_S
        measured = wheel + 0.1 * rng.standard_normal()
        measurement = Measurement(S + round(index * H * S), measured, 0.1**2, FULL_PA if braked else 0.0)
        state, estimate = step(CONFIG, state, measurement)
        if estimate is not None and estimate.withheld:
            rows.append((way, speed, estimate))
        slowing = 9.8 * (mu + float(specific_resistance(np.array(speed)))) if braked else 0.0
        way, speed = way + H * speed, max(speed - H * slowing, 0.0)
        wheel += H * speed * (0.67 if index * H > BRAKE_S + 1.0 else 1.0)
        index += 1
    assert state.counts[Outcome.SLIDING] > 0
    assert len(rows) > 10
    for passed, true, estimate in rows:
        curve = predict(CONFIG, estimate).safe
        assert curve is None or curve.distance_m[-1] > way - passed
        assert estimate.speed_mps > 0.0
        assert abs(estimate.speed_mps - true) < 3.0 * estimate.speed_std_mps


def test_no_train_is_told_to_run_backwards_and_it_may_still_be_as_fast() -> None:
    bank = bank_of([STEADY, STEADY, STEADY])
    bank.mean[:, SPEED] = 20.0, -1.0, -3.0
    bank.covariance[:, SPEED, :] *= 10.0
    bank.covariance[:, :, SPEED] *= 10.0
    after = forwards(bank)
    np.testing.assert_allclose(after.mean[:, SPEED], [20.0, STANDS_MPS, STANDS_MPS])
    np.testing.assert_array_equal(after.covariance[0], bank.covariance[0])
    fastest = [each.mean[:, SPEED] + REACH * np.sqrt(each.covariance[:, SPEED, SPEED]) for each in (bank, after)]
    np.testing.assert_allclose(fastest[1], fastest[0])
    assert (np.linalg.eigvalsh(after.covariance) > -1e-9).all()


def test_no_brake_drives_the_train_on() -> None:
    """Wheels that rolled again after a deep slide seemed to: a train that braked was told as ever faster, to 70 m/s."""
    bank = bank_of([STEADY, STEADY])
    bank.mean[:, MU] = 0.05, -0.1
    after = forwards(bank)
    np.testing.assert_array_equal(after.mean[:, MU], [0.05, 0.0])
    np.testing.assert_array_equal(after.covariance[0], bank.covariance[0])
    assert np.all(np.linalg.eigvalsh(after.covariance) > -1e-12)

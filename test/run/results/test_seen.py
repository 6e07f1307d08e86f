# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Why nothing was identified, of runs in which nothing is."""

from __future__ import annotations

import pytest

from adhesion_node.run.pipeline import BACKWARDS
from adhesion_node.run.results.seen import Seen

S = 10**9


def run(
    slows_mps2: float, pressure_pa: float | None, regime: str = "COASTING", seconds: int = 20, mu_lower: float = 0.02
) -> Seen:
    """A run of mu 0.1 with two estimates a second, the pressure over the last half."""
    seen = Seen()
    for i in range(2 * seconds):
        braked_s = max(i / 2 - seconds / 2, 0.0)
        pressure = pressure_pa if braked_s or pressure_pa is None else 0.0
        seen.note(i * S // 2, regime, 0.1, mu_lower, 40.0 - slows_mps2 * braked_s, pressure)
    return seen


def creeping() -> Seen:
    """Degrees of latitude taken for metres."""
    seen = Seen()
    for i in range(40):
        seen.note(i * S // 2, "COASTING", 0.1, 0.02, 0.00072, 4e5 * (i > 20))
    return seen


@pytest.mark.parametrize(
    ("seen", "why"),
    [
        (run(0.2, 4e5), "no braking harder than 0.3 m/s^2: the hardest was 0.20"),
        (run(0.9, 4e5, "BRAKE_LIMITED", mu_lower=0.114), "the brake limited throughout: the adhesion is at least 0.11"),
        (run(0.9, None), "no brake pressure and no demand came"),
        (run(0.9, None, mu_lower=0.08), "no brake pressure and no demand came"),
        (run(0.9, 4.1), "the brake pressure is 4.1 Pa at most: is its unit right"),
        (run(0.0, 5e5, seconds=40), "the train runs on under brake pressure: is it the brake pipe's"),
        (creeping(), "the train was never faster than 0.00072 m/s: are its positions degrees, or km?"),
        (run(0.9, 4e5), "braked by up to 0.90 m/s^2"),
    ],
)
def test_it_is_said_why_nothing_is_identified(seen: Seen, why: str) -> None:
    said = seen.why_not()
    assert said is not None
    assert said.startswith(why)


def test_an_adhesion_that_limits_is_identified_and_one_that_is_known_while_it_is_open_what_limits() -> None:
    assert run(0.5, 4e5, "ADHESION_LIMITED").why_not() is None
    assert run(0.9, 4e5, mu_lower=0.08).why_not() is None
    assert run(0.2, 1e5, mu_lower=0.08).why_not() is not None, "what coasts shows nothing, however sure it is"


def test_positions_that_fall_come_first() -> None:
    seen = Seen()
    for i in range(40):
        seen.note(i * S // 2, "ADHESION_LIMITED", 0.1, 0.08, -40.0, None)
    assert seen.why_not() == BACKWARDS


def test_the_deceleration_under_the_full_brake_is_its_mean() -> None:
    seen = Seen(4e5)
    for i in range(60):
        braked_s = max(i / 2 - 10.0, 0.0)
        seen.note(i * S // 2, "COASTING", 0.1, 0.02, 60.0 - 0.8 * braked_s, 3.8e5 if braked_s > 4.0 else 1e5)
    assert seen.full_mps2 == pytest.approx(0.8)
    assert Seen(4e5).full_mps2 is None


@pytest.mark.parametrize(("open_s", "identified"), [(1, False), (8, True)])
def test_the_first_moments_at_the_limit_of_the_brake_are_no_identification(open_s: int, identified: bool) -> None:
    seen = Seen()
    for i in range(80):
        regime = "COASTING" if i < 2 * open_s + 6 else "BRAKE_LIMITED"
        seen.note(i * S // 2, regime, 0.1, 0.09, 50.0 - 0.45 * i, 4e5)
    assert seen.identified is identified


@pytest.mark.parametrize(("limited_s", "why"), [(10, "the brake limited throughout"), (4, "braked by up to 0.90")])
def test_a_brake_that_limited_for_moments_did_not_limit_throughout(limited_s: int, why: str) -> None:
    """A metro on leaves, known by the speed of an axle; it stands at the end, its brake applied."""
    seen = Seen()
    for i in range(120):
        regime = "BRAKE_LIMITED" if i < 2 * limited_s else "COASTING"
        seen.note(i * S // 2, regime, 0.1, 0.03, max(18.0 - 0.45 * i, 0.0), 4e5)
    said = seen.why_not()
    assert said is not None
    assert said.startswith(why)


def test_a_gap_is_no_braking() -> None:
    """40 m/s, then after a minute without estimates 5 m/s: nobody saw how it slowed down."""
    seen = Seen()
    for t_s, speed_mps in ((0, 40.0), (2, 40.0), (62, 5.0), (64, 5.0), (66, 5.0)):
        seen.note(t_s * S, "COASTING", 0.05, 0.02, speed_mps, 4e5)
    assert seen.hardest_mps2 == 0.0


@pytest.mark.parametrize("length", [100, 10_000])
def test_it_keeps_no_more_of_a_long_run(length: int) -> None:
    seen = Seen()
    for i in range(length):
        seen.note(i * S // 2, "COASTING", 0.05, 0.02, 30.0, 0.0)
    assert len(seen._newest) <= 7

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the bank says: what limits, bounds in their order, and what of them it counts on ahead."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from banks import FULL, NOTHING, SMOOTH, SPEEDS, S, ahead_bank, bank_of, counted, memory_of
from pressures import sampled
from pressures import seen as seen_by
from scipy.stats import norm

from adhesion_node.core.bank.findings.ahead import constant
from adhesion_node.core.bank.findings.verdict import found
from adhesion_node.core.bank.gear.brake import BrakeSeen
from adhesion_node.core.bank.gear.slides import Slides
from adhesion_node.core.bank.gear.wheels import WheelsSeen
from adhesion_node.core.bank.labels.kinds import HELD, KINDS, OTHER, STEADY
from adhesion_node.core.bank.layout import BRAKE, GRADE, MU, ROUGH, SPEED
from adhesion_node.core.bank.motion import Braking
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.belief.regime import Regime
from adhesion_node.core.config import Config
from adhesion_node.core.physics.train import CRH3

CONFIG = Config(method="bank")


@pytest.mark.parametrize(("share", "stays"), [(0.79, True), (0.81, False)])
def test_under_a_part_of_the_brake_that_the_rail_bears_what_was_known_of_it_holds(share: float, stays: bool) -> None:
    """That was more than is used, as the brake is weaker than believed; the curve counts on what that can use of it."""
    bank = bank_of([HELD], spread=0.0)
    bank.mean[:, BRAKE] = 0.5
    bank = bank._replace(covariance=1e-8 * bank.covariance)
    known = Rail(0.09, 0.01, 0.08)
    findings = found(CONFIG, memory_of(bank, Braking(share * FULL), 3)._replace(known=known), known, NOTHING)
    assert (min(counted(findings.ahead)) >= 0.499 * FULL) == stays
    assert max(counted(findings.ahead)) <= 0.501 * FULL
    assert findings.rail.lower <= findings.rail.mu < 0.05
    assert (findings.known.lower == 0.08) == stays
    assert (findings.known.mu, findings.known.std) == (0.09, max(findings.rail.std, 0.01))


@pytest.mark.parametrize(("regime", "holds"), [(Regime.COASTING, True), (Regime.ADHESION_LIMITED, False)])
def test_a_rail_that_has_limited_gives_no_more_than_it_showed_until_the_brake_is_released(
    regime: Regime, holds: bool
) -> None:
    """On a film below `lowest_mu` cylinders that are let go of look like a part of the brake: curves were too short."""
    bank = bank_of([HELD], spread=0.0)
    memory = memory_of(bank._replace(covariance=1e-8 * bank.covariance), Braking(0.016), 3)._replace(known=NOTHING)
    findings = found(CONFIG, memory.having_told(regime, Rail(0.015, 0.001, 0.012)), NOTHING, NOTHING)
    assert (min(counted(findings.ahead)) > 0.015) == holds
    assert (findings.rail.lower == findings.rail.mu) == holds


def test_while_much_is_open_no_more_is_counted_on_than_was_known() -> None:
    """Of the rail as it was known when the braking began, and as that has aged since, the worse."""
    bank = ahead_bank(0.03, 50.0, [2]).with_fresh(MU, 0.03, 0.03)
    opened = memory_of(bank, Braking(FULL), 3)._replace(known=Rail(0.06, 0.02, 0.04))
    for aged, least in ((0.035, 0.035), (0.05, 0.04)):
        findings = found(CONFIG, opened, Rail(0.06, 0.02, aged), NOTHING)
        assert findings.regime is Regime.COASTING
        fastest = 50.0 + norm.ppf(1.0 - 0.6 * 0.01) * math.sqrt(bank.covariance[0, SPEED, SPEED])
        resisting = float(CRH3.specific_resistance(np.array(50.0)))
        slowing = (50.0 / fastest) ** 2 * (least + resisting)
        fast = counted(findings.ahead, np.array([50.0]))
        assert fast == pytest.approx(slowing - resisting), "the fastest one stops where it is told"
        assert findings.rail.lower == pytest.approx(min(least, findings.rail.mu))


@pytest.mark.parametrize(
    ("used", "alone", "told"),
    [(0.04, True, True), (0.018, True, True), (0.04, False, False), (0.008, True, False), (1.6 * FULL, True, False)],
    ids=["slowed", "on a film", "by no demand", "hardly", "by more than any brake"],
)
def test_a_gauge_that_shows_no_brake_while_the_train_is_slowed(used: float, alone: bool, told: bool) -> None:
    """Another brake works: what it uses is told, and that the rail gives it; nothing is learnt of the rail."""
    bank = bank_of([STEADY], spread=0.0)
    bank.mean[:, MU] = used
    bank = bank._replace(covariance=1e-8 * bank.covariance)
    findings = found(CONFIG, memory_of(bank, Braking(0.0, alone=alone), 0), NOTHING, NOTHING)
    assert findings.regime is Regime.COASTING
    assert findings.known == NOTHING
    if told:
        assert findings.rail.mu == pytest.approx(used)
        assert 0.8 * used < findings.rail.lower <= used
        least = min(counted(findings.ahead))
        assert NOTHING.lower < least < 0.8 * used or least == pytest.approx(NOTHING.lower, rel=1e-4), (
            "what rolls bears it"
        )
    else:
        assert findings.rail == NOTHING
        assert max(counted(findings.ahead)) <= NOTHING.lower


@pytest.mark.parametrize("seen", [0, 3])
@pytest.mark.parametrize("axles", [0, 4])
def test_while_the_gauge_shows_no_brake_nothing_is_claimed_and_learnt(seen: int, axles: int) -> None:
    """It may be a grade that no profile tells, or a brake on the rail itself; axles that roll name no brake then."""
    bank = bank_of([OTHER if seen else STEADY], spread=0.0)
    bank.mean[:, MU] = 0.04
    memory = memory_of(bank._replace(covariance=1e-8 * bank.covariance), Braking(0.0, alone=True), seen)
    released = memory.brake._replace(demanded_pa=0.0, applied_pa=0.0)
    wheels = WheelsSeen(slides=Slides((None,) * axles, (10 * S,) * axles))
    findings = found(CONFIG, memory._replace(brake=released, wheels=wheels), NOTHING, NOTHING)
    assert findings.rail.mu == pytest.approx(0.04)
    assert (findings.regime, findings.known) == (Regime.COASTING, NOTHING)


def test_a_train_of_whose_brake_nothing_is_known_brakes_from_a_fiftieth_of_g_on() -> None:
    """Then the rail gives so much; else it is believed as before."""
    for used, brakes in ((0.018, False), (0.024, True)):
        bank = bank_of([0], spread=0.0)
        bank.mean[:, MU] = used
        memory = memory_of(bank._replace(covariance=1e-8 * bank.covariance), Braking(0.0), 0)
        findings = found(CONFIG, memory._replace(brake=BrakeSeen()), NOTHING, NOTHING)
        assert findings.regime is Regime.COASTING
        assert findings.rail.mu == pytest.approx(used if brakes else NOTHING.mu)
        assert findings.rail.lower == pytest.approx(
            max(NOTHING.lower, 0.9 * used) if brakes else NOTHING.lower, rel=0.2
        )
        assert findings.ahead == constant(NOTHING.lower)


@pytest.mark.parametrize(
    ("sliding", "regime"),
    [(None, Regime.BRAKE_LIMITED), (0, Regime.BRAKE_LIMITED), (1, Regime.COASTING), (2, Regime.ADHESION_LIMITED)],
)
def test_what_limits_is_said_by_the_wheels_and_where_some_slide_by_nothing(sliding: int | None, regime: Regime) -> None:
    """Of four axles; to the train's motion it is the brake in each of the cases."""
    memory = memory_of(bank_of([HELD], spread=0.0), Braking(FULL), 3)
    slid = () if sliding is None else tuple(10 * S if axle < sliding else None for axle in range(4))
    memory = memory._replace(wheels=WheelsSeen(slides=Slides(slid, (10 * S,) * len(slid))))
    assert found(CONFIG, memory, NOTHING, NOTHING).regime is regime


@pytest.mark.parametrize("wheels", [(), (None,) * 4], ids=["no wheels", "wheels that roll"])
@pytest.mark.parametrize("rises_pa_s", [18e3, 12e3, 0.0], ids=["the protection", "a valve's play", "the driver"])
def test_while_the_pressure_falls_and_rises_the_brake_is_not_said_to_limit(
    wheels: tuple[None, ...], rises_pa_s: float
) -> None:
    """Gentle slide protection holds all axles below the creep that a wheel shows; it was the brake that was named.

    A driver who lets go a part once is past it 8 s later.
    """
    memory = memory_of(bank_of([HELD], spread=0.0), Braking(FULL), 3)
    slid = WheelsSeen(slides=Slides(wheels, (10 * S,) * len(wheels)))
    samples = sampled(lambda time: 250e3 + rises_pa_s * (time % 2.0) if time >= 2.0 else 320e3, 12.0)
    brake = seen_by(CONFIG, samples, rolls=True)[-1]
    pressed = memory.brake._replace(fell_ns=brake.fell_ns)
    memory = memory._replace(wheels=slid, brake=pressed, t_ns=samples[-1].t_ns)
    regime = Regime.COASTING if rises_pa_s > 15e3 else Regime.BRAKE_LIMITED
    assert found(CONFIG, memory, NOTHING, NOTHING).regime is regime


@pytest.mark.parametrize(("part", "regime"), [(0.71, Regime.BRAKE_LIMITED), (0.69, Regime.COASTING)])
def test_where_far_less_is_used_than_the_brake_should_give_rolling_wheels_claim_nothing(
    part: float, regime: Regime
) -> None:
    """All of them may be held at the same creep, which none of them shows."""
    config = replace(CONFIG, brake_std=0.1, mass_std=0.0, rotating_mass_std=0.0)
    bank = bank_of([HELD], spread=0.0)
    bank.mean[:, BRAKE] = part
    memory = memory_of(bank._replace(covariance=1e-8 * bank.covariance), Braking(FULL), 3)
    memory = memory._replace(wheels=WheelsSeen(slides=Slides((None,) * 4, (10 * S,) * 4)))
    assert found(config, memory, NOTHING, NOTHING).regime is regime


def limits(kind: int, used: float, told: float = 0.0, config: Config = CONFIG, gauged: bool = False) -> Regime:
    """Without wheels, of a train that slows down for this reason by this part of its full brake."""
    bank = bank_of([kind], spread=0.0).with_fresh(ROUGH, 0.0, 0.0)
    bank.mean[:, MU], bank.mean[:, BRAKE] = used * FULL, 1.0
    bank = bank._replace(covariance=1e-8 * bank.covariance)
    memory = memory_of(bank, Braking(used * FULL if kind == HELD else FULL, told=told), 3)
    memory = memory._replace(brake=memory.brake._replace(gauged=gauged))
    return found(config, memory, NOTHING, NOTHING).regime


def test_wheels_that_roll_say_that_no_rail_limits_whatever_the_brake_lacks() -> None:
    """Pads that fade by a quarter or more look like a rail that gives less, and no wheel slides."""
    bank = bank_of([SMOOTH], spread=0.0)
    bank.mean[:, MU] = 0.5 * FULL
    memory = memory_of(bank._replace(covariance=1e-8 * bank.covariance), Braking(FULL), 3)
    assert found(CONFIG, memory, NOTHING, NOTHING).regime is Regime.ADHESION_LIMITED
    rolling = memory._replace(wheels=WheelsSeen(slides=Slides((None,) * 4, (10 * S,) * 4)))
    assert found(CONFIG, rolling, NOTHING, NOTHING).regime is Regime.COASTING


def test_a_rail_is_said_to_limit_only_where_no_wrong_brake_explains_it_as_well() -> None:
    config = replace(CONFIG, brake_std=0.1, mass_std=0.0, rotating_mass_std=0.0)
    assert limits(SMOOTH, 0.79, config=config) is Regime.ADHESION_LIMITED
    assert limits(SMOOTH, 0.81, config=config) is Regime.COASTING
    assert limits(HELD, 0.91, config=config) is Regime.BRAKE_LIMITED
    assert limits(HELD, 0.89, config=config) is Regime.COASTING
    assert limits(SMOOTH, 0.5) is Regime.ADHESION_LIMITED
    assert limits(SMOOTH, 0.97) is Regime.COASTING
    mean, one = replace(config, pressure_kind="mean"), replace(config, pressure_kind="cylinder")
    assert limits(SMOOTH, 0.97, told=4.0, config=mean) is Regime.ADHESION_LIMITED, "the slide protection says it"
    assert limits(SMOOTH, 0.91, told=4.0, config=one) is Regime.COASTING, "of one axle, maybe the only one"
    assert limits(SMOOTH, 0.89, told=4.0, config=one) is Regime.ADHESION_LIMITED


@pytest.mark.parametrize(("kind", "part"), [("cylinder", 0.7), ("mean", 0.7), ("demanded", 0.8)])
def test_a_gauge_that_shows_no_slide_protection_at_work_speaks_for_a_weak_brake(kind: str, part: float) -> None:
    """Of a train a quarter of whose brakes are isolated the rail was said to limit."""
    config = replace(CONFIG, brake_std=0.1, mass_std=0.0, rotating_mass_std=0.0, pressure_kind=kind)
    assert limits(SMOOTH, part - 0.01, config=config, gauged=True) is Regime.ADHESION_LIMITED
    assert limits(SMOOTH, part + 0.01, config=config, gauged=True) is Regime.COASTING


def test_a_brake_is_said_to_limit_only_where_it_gives_what_is_demanded() -> None:
    assert limits(HELD, 1.0) is Regime.BRAKE_LIMITED
    assert limits(HELD, 1.0, config=replace(CONFIG, pressure_kind="mean")) is Regime.BRAKE_LIMITED
    assert limits(HELD, 0.5) is Regime.COASTING
    assert limits(HELD, 1.5) is Regime.COASTING, "another brake that no gauge shows"


def test_whether_a_brake_weaker_than_a_film_limits_wheels_alone_can_tell() -> None:
    """A freight train, whose whole brake asks for 0.024: leaves may give as much, and what they give looks the same."""
    for mass, regime in ((1.0, Regime.BRAKE_LIMITED), (2.3, Regime.BRAKE_LIMITED), (2.5, Regime.COASTING)):
        config = replace(CONFIG, train=replace(CRH3, mass_kg=mass * CRH3.mass_kg))
        bank = bank_of([HELD], spread=0.0)
        bank.mean[:, BRAKE] = 1.0
        memory = memory_of(bank._replace(covariance=1e-8 * bank.covariance), Braking(FULL / mass), 3)
        assert found(config, memory, NOTHING, NOTHING).regime is regime
        rolls = memory._replace(wheels=WheelsSeen(slides=Slides((None,) * 4, (10 * S,) * 4)))
        assert found(config, rolls, NOTHING, NOTHING).regime is Regime.BRAKE_LIMITED


@pytest.mark.parametrize("seed", range(12))
def test_bounds_stand_in_their_order_whatever_the_bank(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 20))
    bank = bank_of(rng.integers(1, len(KINDS), count).tolist(), rng.integers(0, 3, count).tolist(), seed=seed)
    wild = 10.0 ** rng.uniform(-6.0, 3.0)
    bank = bank._replace(mean=bank.mean.copy(), covariance=wild * bank.covariance)
    bank.mean[:, MU] = rng.choice([-0.3, -0.01, 0.0, 1e-9, 0.02, 0.5, 3.0], count)
    bank.mean[:, SPEED] = rng.choice([-5.0, 0.0, 1e-6, 3.0, 80.0, 500.0], count)
    bank.mean[:, GRADE] = rng.choice([-0.5, 0.0, 0.5], count)
    for seen, braking in ((0, Braking(0.0)), (3, Braking(FULL)), (3, Braking(FULL, 0.5, True, 4.0))):
        findings = found(CONFIG, memory_of(bank, braking, seen), NOTHING, NOTHING)
        rail, ahead = findings.rail, findings.ahead
        assert 0.0 <= rail.lower <= rail.mu < math.inf
        assert 0.0 < rail.std < math.inf
        assert all(0.0 <= each < math.inf for each in ahead.speed_mps)
        slowing = counted(ahead) + CRH3.specific_resistance(SPEEDS)
        assert ((slowing >= -1e-15) & np.isfinite(slowing)).all(), "a train that may be faster slows less, but does"
        assert np.all(np.isfinite(bank.moments(2)[0]))


def test_the_bound_is_the_mixtures_and_below_its_median() -> None:
    bank = ahead_bank(0.05, 50.0, [2])
    rail = found(CONFIG, memory_of(bank, Braking(FULL), 3), NOTHING, NOTHING).rail
    std = math.hypot(
        math.sqrt(
            bank.covariance[0, MU, MU]
            + (0.05**2) * bank.covariance[0, ROUGH, ROUGH]
            + 2 * 0.05 * bank.covariance[0, MU, ROUGH]
        ),
        CONFIG.used_ripple * 0.05,
    )
    low, high = norm.ppf([0.025, 0.975], 0.05, std)
    bound = norm.ppf(0.6 * 0.05, 0.05, math.hypot(std, 2.0 * CONFIG.used_ripple * 0.05))
    assert (rail.mu, rail.lower) == pytest.approx((0.05, bound), rel=1e-6)
    assert rail.std == pytest.approx((high - low) / 3.92, rel=1e-6)
    assert 0.0 < rail.lower < rail.mu


def test_the_fewer_axles_the_more_one_of_them_takes_away() -> None:
    """Slide protection that lets go of one axle: of a tram of 32 m as sqrt(200/32) times of a train of 200 m."""
    bank = bank_of([SMOOTH], spread=0.0).with_fresh(ROUGH, 0.0, 0.0)
    bank = bank._replace(covariance=1e-12 * bank.covariance)
    for length_m, ripple in ((200.0, 0.025), (32.0, 0.0625), (700.0, 0.01336), (2.0, 0.0791)):
        config = replace(CONFIG, train=replace(CRH3, length_m=length_m))
        rail = found(config, memory_of(bank, Braking(FULL), 3), NOTHING, NOTHING).rail
        assert rail.std == pytest.approx(ripple * rail.mu, rel=0.01)
        assert rail.lower == pytest.approx((1.0 + norm.ppf(0.6 * 0.05) * 5.0**0.5 * ripple) * rail.mu, rel=0.01)

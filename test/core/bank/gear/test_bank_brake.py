# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the brake does by its pressures: what is demanded, applied and released."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from banks import FULL_PA, S
from pressures import CYLINDER, DEMANDED, MEAN, MS, applying, cycling, released, sampled, seen

from adhesion_node.core.bank.gear.brake import BrakeSeen
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import DemandSample


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
@pytest.mark.parametrize("told_by", ["wheels", "demand"])
def test_a_release_that_wheels_or_the_demand_tell_is_no_dump(config: Config, told_by: str) -> None:
    brake = BrakeSeen()
    for sample in sampled(released, 12.0):
        time = (sample.t_ns - S) / S
        demand_pa = (FULL_PA if time < 4.0 else 150e3) if told_by == "demand" else None
        brake = brake.after(config, [sample], demand_pa, rolls=told_by == "wheels")
        assert not brake.has_slid(sample.t_ns)
        assert time < 9.0 or brake.applied_pa == pytest.approx(150e3, rel=0.02)


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
def test_a_demand_counts_from_its_own_time_on(config: Config) -> None:
    """In a tick that brings five pressures and a demand; the next ones bring it later than their pressures."""
    empty, demands = sampled(lambda _: 0.0, 0.8), [DemandSample(S + S // 2, FULL_PA)]
    before = BrakeSeen().after(config, empty[:1], 0.0, None, [DemandSample(S, 0.0)])
    assert before.after(config, empty[1:5], FULL_PA, None, demands).applied_pa == 0.0
    brake = before.after(config, empty[1:6], FULL_PA, None, demands)
    assert brake.applied_pa == pytest.approx(FULL_PA * 0.1 / config.brake_build_up_s)
    for index, sample in enumerate(empty[6:], 2):
        brake = brake.after(config, [sample], FULL_PA, None, [DemandSample(sample.t_ns + MS, FULL_PA)])
        assert brake.demanded_pa == FULL_PA
        assert brake.applied_pa == pytest.approx(FULL_PA * 0.1 * index / config.brake_build_up_s)
    assert brake.after(config, [sample._replace(t_ns=2 * S)], None).applied_pa < brake.applied_pa  # heard no more


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
def test_a_dump_that_wheels_see_later_than_the_pressure_is_one(config: Config) -> None:
    samples, brake = sampled(cycling(1.0, 40e3), 5.0), BrakeSeen()
    for sample in samples:
        brake = brake.after(config, [sample], None, rolls=sample.t_ns - S < 4.4 * S)
    assert brake.has_slid(samples[-1].t_ns)
    assert brake.demanded_pa > 0.9 * FULL_PA


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
@pytest.mark.parametrize("share", [0.0, 0.3])
def test_what_cylinders_lack_of_the_demand_an_electric_brake_gives(config: Config, share: float) -> None:
    """It builds up and lets go with the demand, as the cylinders would."""
    brake, pressed = BrakeSeen(), []
    for sample in sampled(lambda time: share * applying(time), 12.0):
        brake = brake.after(config, [sample], FULL_PA if sample.t_ns - S < 6 * S else 0.0)
        pressed.append(brake.applied_pa / FULL_PA)
        assert not brake.has_slid(sample.t_ns)
    assert pressed[5:55:10] == pytest.approx([0.25, 0.75, 1.0, 1.0, 1.0], abs=0.3)
    assert pressed[58] == pytest.approx(1.0)
    assert pressed[-1] == pytest.approx(share, abs=0.01)


def test_while_every_axle_rolls_the_newest_pressure_presses() -> None:
    """Else the mean, which slide protection makes swing; while a driver releases it would be up to twice as much."""
    samples = sampled(released, 6.0)
    behind = np.array([each.applied_pa for each in seen(MEAN, samples)]) / [
        max(one.pressure_pa, 1.0) for one in samples
    ]
    assert np.max(behind[45:]) > 1.5
    assert [each.applied_pa for each in seen(MEAN, samples, rolls=True)] == [one.pressure_pa for one in samples]


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
def test_what_a_gauge_may_not_have_shown_is_its_last_change(config: Config) -> None:
    """In proportion to the time since, up to the whole of it; none is left once a sample tells."""
    one, *more = seen(config, sampled(applying, 2.5, every_ms=500))
    assert one.unseen_pa(2 * S) == 0.0
    for index, brake in enumerate(more[:3], 1):
        unseen = [brake.unseen_pa(S + index * S // 2 + round(since * S)) for since in (0.0, 0.1, 0.5, 3.0)]
        assert unseen == pytest.approx([0.0, 0.05 * FULL_PA, 0.25 * FULL_PA, 0.25 * FULL_PA])
    assert seen(config, sampled(released, 8.0))[-1].unseen_pa(20 * S) < 0.01 * FULL_PA


def test_a_dump_leaves_nothing_unseen() -> None:
    """What presses is what is demanded then."""
    brake = seen(CYLINDER, sampled(cycling(1.0, 40e3), 4.3))[-1]
    assert brake.has_slid(brake.recent[-1].t_ns)
    assert brake.unseen_pa(brake.recent[-1].t_ns + S) == 0.0


@pytest.mark.parametrize("kind", [CYLINDER, MEAN])
@pytest.mark.parametrize("slid", [False, True])
@pytest.mark.parametrize("seconds", [0.3, 1.5, 4.0])
def test_a_release_is_seen(kind: Config, slid: bool, seconds: float) -> None:
    """However fast it is released, at most 1.5 s after the cylinder is empty, also behind a slide."""
    braked = cycling(2.0, 40e3) if slid else applying
    start = braked(8.0)

    def pressure(time: float) -> float:
        return braked(time) if time < 8.0 else max(start * (1.0 - (time - 8.0) / seconds), 0.0)

    samples = sampled(pressure, 16.0)
    for sample, brake in zip(samples, seen(kind, samples), strict=True):
        if sample.t_ns - S > round((8.0 + seconds) * 1000) * MS + 1600 * MS:
            assert brake.demanded_pa == 0.0, (sample.t_ns - S) / S
            assert brake.dumped_ns is None or sample.t_ns - brake.dumped_ns > 1500 * MS


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
@pytest.mark.parametrize("within_s", [2.1, 3.0])
@pytest.mark.parametrize("left", [0.0, 0.3])
def test_a_release_as_quick_as_the_build_up_is_heard_as_one_by_the_pressure_alone(
    config: Config, within_s: float, left: float
) -> None:
    """A driver who pumps the brake: 90 % of what is let go of goes within the build-up time, and comes again."""

    def pressure(time: float) -> float:
        since = math.fmod(time, 8.0)
        if since < 4.0:
            return FULL_PA * max(left, min(since / 2.0, 1.0))
        return FULL_PA * (left + (1.0 - left) * math.pow(0.1, (since - 4.0) / within_s))

    for brake in seen(config, sampled(pressure, 24.0, noise_pa=500.0)):
        assert brake.dumped_ns is None
    steep = replace(config, brake_build_up_s=20.0)  # of a brake that does all this slowly it is none
    assert any(brake.dumped_ns for brake in seen(steep, sampled(pressure, 24.0)))


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
def test_what_falls_no_quicker_than_a_release_but_comes_back_at_once_is_a_dump(config: Config) -> None:
    """The pulses of a valve: a quarter within 0.4 s, and back within 0.4 s."""

    def pressure(time: float) -> float:
        return applying(time) if time < 4.0 else FULL_PA * (1.0 - 0.25 * math.sin(math.pi * (time - 4.0) / 0.8) ** 2)

    samples = sampled(pressure, 8.0)
    for sample, brake in zip(samples, seen(config, samples), strict=True):
        time = (sample.t_ns - S) / S
        assert brake.has_slid(sample.t_ns) == (time > 4.0) or 4.0 < time < 5.0


def test_a_slow_release_is_followed_at_once() -> None:
    samples = sampled(lambda t: applying(t) if t < 6.0 else max(FULL_PA - 50e3 * (t - 6.0), 0.0), 16.0)
    for sample, brake in zip(samples, seen(CYLINDER, samples), strict=True):
        assert brake.demanded_pa == sample.pressure_pa
        assert brake.dumped_ns is None


def test_noise_is_no_dump() -> None:
    samples = sampled(applying, 60.0, noise_pa=5e3)
    assert not any(brake.has_slid(S) or brake.dumped_ns for brake in seen(CYLINDER, samples))


def test_a_demanded_pressure_is_followed_within_the_build_up_time() -> None:
    samples = sampled(lambda t: FULL_PA if 1.0 <= t < 7.0 else 0.0, 12.0)
    for sample, brake in zip(samples, seen(DEMANDED, samples), strict=True):
        time = (sample.t_ns - S) / S
        assert brake.demanded_pa == sample.pressure_pa
        assert not brake.has_slid(sample.t_ns)  # a demand tells of no dump
        up = min(max(time - 0.9, 0.0) / 2.0, 1.0)
        down = max(1.0 - (time - 6.9) / 2.0, 0.434 * 0.1 ** ((time - 6.9 - 1.13) / 2.0) * (time > 8.0))
        assert brake.applied_pa == pytest.approx(FULL_PA * (up if time < 6.95 else down), rel=0.03, abs=1.0), time


def test_the_handle_beside_a_cylinder_tells_what_is_demanded() -> None:
    samples = sampled(cycling(2.0, 0.0), 12.0)
    for sample, brake in zip(samples, seen(CYLINDER, samples, FULL_PA), strict=True):
        assert brake.demanded_pa == FULL_PA
        if brake.dumped_ns is not None:
            assert brake.applied_pa == FULL_PA
        else:
            assert brake.applied_pa == pytest.approx(sample.pressure_pa)
    released = seen(CYLINDER, samples, 0.0)
    assert all(brake.demanded_pa == 0.0 for brake in released)


@pytest.mark.parametrize("config", [CYLINDER, MEAN, DEMANDED])
def test_any_split_of_the_pressures_gives_the_same(config: Config) -> None:
    samples, rng = sampled(cycling(2.0, 40e3), 12.0, 50, noise_pa=3e3), np.random.default_rng(4)
    one = BrakeSeen().after(config, samples, None)
    for _ in range(5):
        brake, rest = BrakeSeen(), samples
        while rest:
            cut = int(rng.integers(1, 40))
            brake, rest = brake.after(config, rest[:cut], None), rest[cut:]
        assert brake == one


def test_a_brake_being_applied_is_told_from_a_steady_one() -> None:
    for sample, brake in zip(samples := sampled(applying, 8.0), seen(CYLINDER, samples), strict=True):
        time = (sample.t_ns - S) / S
        if 0.2 <= time <= 2.0:
            assert brake.rising
        elif time > 3.0:
            assert not brake.rising
    assert not any(brake.rising for brake in seen(CYLINDER, sampled(lambda time: 3e5 * (1.0 + 0.05 * time), 6.0)))
    assert not BrakeSeen().known
    assert not BrakeSeen().rising


def test_what_is_remembered_is_bounded() -> None:
    brake = seen(CYLINDER, sampled(applying, 30.0, 10))[-1]
    assert len(brake.recent) <= 101
    assert math.isclose(brake.demanded_pa, FULL_PA)

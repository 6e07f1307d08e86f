# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Cylinders under slide protection: that they are dumped, cycled and held low is no release."""

from __future__ import annotations

import math

import pytest
from banks import FULL_PA, S
from pressures import CYLINDER, MEAN, MS, applying, cycling, sampled, seen

from adhesion_node.core.bank.gear.brake import BrakeSeen
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import PressureSample


@pytest.mark.parametrize("every_ms", [50, 100, 200])
@pytest.mark.parametrize("least_pa", [0.0, 40e3, 150e3])
@pytest.mark.parametrize("period_s", [1.0, 2.0])
def test_cycles_of_one_cylinder_are_no_release(period_s: float, least_pa: float, every_ms: int) -> None:
    samples = sampled(cycling(period_s, least_pa), 24.0, every_ms)
    for sample, brake in zip(samples, seen(CYLINDER, samples), strict=True):
        time = (sample.t_ns - S) / S
        if time > 4.5:
            assert brake.demanded_pa > 0.9 * FULL_PA, time
            assert brake.applied_pa > 0.9 * FULL_PA, time  # the other cylinders
            assert brake.has_slid(sample.t_ns)
        elif time < 4.0:
            assert not brake.has_slid(sample.t_ns)
            assert brake.demanded_pa == pytest.approx(applying(time))


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
@pytest.mark.parametrize("period_s", [2.7, 3.4, 4.3])
def test_cycles_that_are_heard_once_a_second_are_no_release(config: Config, period_s: float) -> None:
    """Dumps fall between samples; the first seconds behind the first one may still look like a brake that is eased."""
    samples = sampled(cycling(period_s, 40e3), 60.0, 1000)
    for sample, brake in zip(samples, seen(config, samples), strict=True):
        assert brake.demanded_pa > 0.9 * FULL_PA or (sample.t_ns - S) / S < 4.0 + 2.0 * period_s


@pytest.mark.parametrize("every_ms", [100, 1000])
def test_a_brake_that_is_eased_is_eased_however_seldom_it_is_heard(every_ms: int) -> None:
    samples = sampled(
        lambda time: applying(time) if time < 8.0 else max(FULL_PA * (1.0 - 0.15 * (time - 8.0)), 0.0), 20.0, every_ms
    )
    brakes = seen(CYLINDER, samples)
    assert all(brake.demanded_pa == sample.pressure_pa for sample, brake in zip(samples, brakes, strict=True))


def test_a_cylinder_that_is_held_low_while_axles_slide_is_not_eased() -> None:
    """No further dump is seen; what axles that roll tell, or an empty cylinder, ends it."""
    samples, brake = sampled(lambda time: applying(time) if time < 4.0 else 0.2 * FULL_PA, 30.0), BrakeSeen()
    for sample in samples:
        brake = brake.after(CYLINDER, [sample], None, rolls=False)
    assert brake.demanded_pa == FULL_PA
    assert brake.after(CYLINDER, [PressureSample(31 * S, 0.2 * FULL_PA)], None, rolls=True).demanded_pa == 0.2 * FULL_PA
    for index in range(50):
        brake = brake.after(CYLINDER, [PressureSample(31 * S + index * 100 * MS, 0.0)], None, rolls=False)
    assert brake.demanded_pa < FULL_PA


@pytest.mark.parametrize(("rolls", "demanded_pa"), [(False, FULL_PA), (True, 0.0), (None, 0.0)])
def test_a_cylinder_that_is_empty_for_seconds_while_axles_slide_is_not_released(
    rolls: bool | None, demanded_pa: float
) -> None:
    """Gentle protection empties it until the rim has come back: on a film of 0.02 that takes as long."""
    brake = BrakeSeen()
    for sample in sampled(lambda time: applying(time) if time < 4.0 else 0.0, 7.0):
        brake = brake.after(CYLINDER, [sample], None, rolls=False if sample.t_ns < 6 * S else rolls)
    assert brake.demanded_pa == demanded_pa


@pytest.mark.parametrize("least_pa", [200e3, 300e3])
def test_a_mean_pressure_swings_but_the_demand_is_held(least_pa: float) -> None:
    samples = sampled(cycling(2.0, least_pa), 24.0)
    brakes = seen(MEAN, samples)
    later = [(sample, brake) for sample, brake in zip(samples, brakes, strict=True) if sample.t_ns - S > 7 * S]
    assert all(brake.demanded_pa > 0.9 * FULL_PA for _, brake in later)
    assert all(brake.applied_pa == brake.demanded_pa for _, brake in later)  # axles that roll are pressed with all


@pytest.mark.parametrize("every_ms", [50, 100, 200])
def test_behind_a_dump_small_swings_tell_that_the_protection_is_at_work(every_ms: int) -> None:
    def pressure(time: float) -> float:
        return applying(time) if time < 4.0 else FULL_PA * (0.6 + 0.05 * math.sin(math.pi * time))

    samples = sampled(pressure, 24.0, every_ms, noise_pa=500.0)
    for sample, brake in zip(samples, seen(MEAN, samples), strict=True):
        if sample.t_ns > 6 * S:
            assert brake.has_slid(sample.t_ns)
            assert brake.demanded_pa > 0.9 * FULL_PA
            assert not brake.rising


@pytest.mark.parametrize("size", [-0.1, 0.1])
def test_behind_a_dump_a_single_dip_or_hump_tells_it_too(size: float) -> None:
    """At 7 to 7.8 s, when the pressure has been steady for 3 s: the protection is at work for 4 s more."""

    def pressure(time: float) -> float:
        bent = size * math.sin(math.pi * (time - 7.0) / 0.8) if 7.0 < time < 7.8 else 0.0
        return applying(time) if time < 4.0 else FULL_PA * (0.6 + bent)

    for sample in (samples := sampled(pressure, 14.0)):
        assert sample.pressure_pa <= FULL_PA
    for sample, brake in zip(samples, seen(MEAN, samples), strict=True):
        time = (sample.t_ns - S) / S
        if 5.0 < time < 11.0:
            assert brake.demanded_pa == pytest.approx(FULL_PA), time
        elif time > 12.5:
            assert brake.demanded_pa == sample.pressure_pa, time


@pytest.mark.parametrize("from_pa", [150e3, 250e3, FULL_PA])
@pytest.mark.parametrize("every_ms", [50, 100, 200])
def test_a_driver_who_releases_in_even_steps_as_fast_as_he_applies_is_no_dump(every_ms: int, from_pa: float) -> None:
    """From a part of the brake that is more of it in half a second than as cylinders empty by themselves."""
    rate = FULL_PA / CYLINDER.brake_build_up_s

    def pressure(time: float) -> float:
        return min(rate * time, from_pa) if time < 6.0 else max(from_pa - rate * (time - 6.0), 0.0)

    samples = sampled(pressure, 12.0, every_ms)
    assert not any(brake.has_slid(sample.t_ns) for sample, brake in zip(samples, seen(CYLINDER, samples), strict=True))


def test_a_valve_that_holds_a_cylinder_low_for_two_seconds_is_no_release() -> None:
    samples = sampled(lambda time: cycling(10.0, 150e3)(min(time, 5.0)), 6.3)
    assert samples[-1].pressure_pa == 150e3
    newest = seen(CYLINDER, samples)[-1]
    assert (newest.demanded_pa, newest.applied_pa) == (FULL_PA, FULL_PA)


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
def test_behind_a_dump_a_steady_or_falling_pressure_is_the_drivers_again(config: Config) -> None:
    def pressure(time: float) -> float:
        return applying(time) if time < 4.0 else FULL_PA * (0.6 - 0.01 * (time - 4.0))

    samples = sampled(pressure, 24.0, noise_pa=500.0)
    for sample, brake in zip(samples, seen(config, samples), strict=True):
        if sample.t_ns > 10 * S:
            assert not brake.has_slid(sample.t_ns)
            assert brake.applied_pa == pytest.approx(sample.pressure_pa, rel=0.03)


def test_behind_a_dump_of_a_slight_brake_the_noise_of_a_gauge_is_no_protection() -> None:
    """3 % of what is demanded is less than the noise; the rail seemed to limit for as long as the brake was applied."""

    def pressure(time: float) -> float:
        return 0.0 if 4.0 < time < 5.0 else 0.2 * applying(time if time < 4.0 else time - 5.0)

    samples = sampled(pressure, 24.0, noise_pa=2e3)
    brakes = seen(CYLINDER, samples, demand_pa=0.2 * FULL_PA)
    assert brakes[45].has_slid(samples[45].t_ns)
    for sample, brake in zip(samples[120:], brakes[120:], strict=True):
        assert not brake.has_slid(sample.t_ns)


def test_of_a_brake_that_is_eased_a_dump_before_tells_nothing() -> None:
    """Its axles slid under more than is demanded now; they are still pressed harder, as cylinders empty slowly."""
    brake, slid = BrakeSeen(), list[bool]()
    for sample in sampled(lambda time: cycling(1.0, 40e3)(time) if time < 6.0 else 0.2 * FULL_PA, 9.0):
        time = (sample.t_ns - S) / S
        brake = brake.after(CYLINDER, [sample], FULL_PA if time < 6.0 else 0.2 * FULL_PA)
        slid.append(brake.has_slid(sample.t_ns))
        if time >= 6.0:
            assert brake.applied_pa >= FULL_PA * (0.2 + 0.79 * 0.1 ** ((time - 5.9) / CYLINDER.brake_build_up_s))
    assert slid[59]
    assert not any(slid[61:])

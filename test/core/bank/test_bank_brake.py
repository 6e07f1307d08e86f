# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the brake does by its pressures: cycles of the slide protection are no release, a release is one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from banks import FULL_PA, S

from adhesion_node.core.bank.gear.brake import BrakeSeen
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import PressureSample

MS = S // 1000
CYLINDER, MEAN, DEMANDED = (Config(method="bank", pressure_kind=kind) for kind in ("cylinder", "mean", "demanded"))


def sampled(
    pressure: Callable[[float], float], seconds: float, every_ms: int = 100, noise_pa: float = 0.0
) -> list[PressureSample]:
    rng = np.random.default_rng(1)
    stamps = range(S, S + round(seconds * 1000) * MS, every_ms * MS)
    return [PressureSample(t, pressure((t - S) / S) + noise_pa * rng.standard_normal()) for t in stamps]


def seen(config: Config, samples: list[PressureSample], demand_pa: float | None = None) -> list[BrakeSeen]:
    brakes = [BrakeSeen()]
    for sample in samples:
        brakes.append(brakes[-1].after(config, [sample], demand_pa))
    return brakes[1:]


def applying(time: float) -> float:
    """Built up within 2 s."""
    return FULL_PA * min(time / 2.0, 1.0)


def cycling(period_s: float, least_pa: float) -> Callable[[float], float]:
    """From 4 s on dumped in 0.3 s, held low for half a period, and built up again, over and over."""

    def pressure(time: float) -> float:
        if time < 4.0:
            return applying(time)
        phase = (time - 4.0) % period_s
        if phase < 0.3:
            return FULL_PA + (least_pa - FULL_PA) * phase / 0.3
        if phase < 0.5 * period_s:
            return least_pa
        return least_pa + (FULL_PA - least_pa) * min((phase - 0.5 * period_s) / (0.4 * period_s), 1.0)

    return pressure


def released(time: float) -> float:
    """From 4 s on eased to 150 kPa within 0.8 s, as a valve does."""
    return applying(time) if time < 4.0 else 150e3 + (FULL_PA - 150e3) * 0.1 ** ((time - 4.0) / 0.8)


@pytest.mark.parametrize("config", [CYLINDER, MEAN])
@pytest.mark.parametrize("told_by", ["wheels", "demand"])
def test_a_release_that_wheels_or_the_demand_tell_is_no_dump(config: Config, told_by: str) -> None:
    brake = BrakeSeen()
    for sample in sampled(released, 12.0):
        time = (sample.t_ns - S) / S
        demand_pa = (FULL_PA if time < 4.0 else 150e3) if told_by == "demand" else None
        brake = brake.after(config, [sample], demand_pa, rolls=told_by == "wheels")
        assert not brake.has_slid(sample.t_ns)
        assert time < 7.0 or brake.applied_pa == pytest.approx(150e3, rel=0.02)


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
    for index in range(20):
        brake = brake.after(CYLINDER, [PressureSample(31 * S + index * 100 * MS, 0.0)], None, rolls=False)
    assert brake.demanded_pa < FULL_PA


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
        up, down = min(max(time - 0.9, 0.0) / 2.0, 1.0), max(1.0 - (time - 6.9) / 2.0, 0.0)
        assert brake.applied_pa == pytest.approx(FULL_PA * (up if time < 6.95 else down), rel=0.02, abs=1.0), time


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

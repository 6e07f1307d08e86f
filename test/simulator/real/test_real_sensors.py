# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Every sensor of the real train against its own settings."""

from pathlib import Path

import numpy as np
import pytest
from rides import BRAKING_MPS2, CRUISE_S, GRADE, GROUPS, NOMINAL, PITCH_RAD, RADIUS_M, SLID, SPEED_MPS, ride

from adhesion_node.core.physics.train import Array
from adhesion_node.wire.files.track import read_track_line
from sim_node.real.plant.journey import GRAVITY
from sim_node.real.sensors.centre_line import BEGINS_M, geojson
from sim_node.real.sensors.imu import Imu, specific_force
from sim_node.real.sensors.position import Gnss, GnssFix, TachoPosition
from sim_node.real.sensors.pressure import CYLINDER, DEMANDED, MEAN, Pressure
from sim_node.real.sensors.sensor import Sensor, wander
from sim_node.real.sensors.speed import DOPPLER, RADAR, Speedometer, TachoSpeed
from sim_node.real.sensors.timing import Spells
from sim_node.real.sensors.wheels import Wheels

RIDE = ride()
TIMES = np.arange(0.05, RIDE.journey.time_s[-1], 0.1)
BRAKED = TIMES > CRUISE_S
SCALE = NOMINAL.wheel_radius_m / RADIUS_M


def _rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def _true(series: Array) -> Array:
    return RIDE.at(TIMES, series)


def _errors(sensor: Sensor, true: Array, seeds: int = 200) -> Array:
    """Of one value, shape (seeds, N)."""
    return np.array([sensor.measure(RIDE, TIMES, _rng(seed)).values[:, 0] - true for seed in range(seeds)])


def test_a_wandering_error_is_stationary_with_its_variance_and_correlation_time() -> None:
    times = np.arange(0.0, 40_000.0, 0.5)
    x = wander(times, 2.0, 30.0, _rng())
    assert x.std() == pytest.approx(2.0, rel=0.05)
    for lag_s in (5.0, 30.0, 60.0):
        lag = round(lag_s / 0.5)
        assert np.corrcoef(x[:-lag], x[lag:])[0, 1] == pytest.approx(np.exp(-lag_s / 30.0), abs=0.04)
    starts = np.array([wander(times[:3], 2.0, 30.0, _rng(seed))[0] for seed in range(2000)])
    assert starts.std() == pytest.approx(2.0, rel=0.05)
    assert wander(times[:1], 2.0, 30.0, _rng()).shape == (1,)
    assert wander(times[:0], 2.0, 30.0, _rng()).shape == (0,)


def test_satellite_positions_err_slowly_and_little_from_fix_to_fix() -> None:
    errors = _errors(Gnss(correlated_std_m=2.0, correlation_s=30.0, white_std_m=0.1), _true(RIDE.journey.position_m))
    assert errors.std() == pytest.approx(np.hypot(2.0, 0.1), rel=0.05)
    # from fix to fix: twice the white variance, and of the slow part 2 s^2 (1 - exp(-0.1/30))
    step = np.sqrt(2 * 0.1**2 + 2 * 2.0**2 * (1.0 - np.exp(-0.1 / 30.0)))
    assert np.diff(errors, axis=1).std() == pytest.approx(step, rel=0.02)
    assert Gnss().std_m == pytest.approx(2.0025, abs=1e-4)


@pytest.mark.parametrize("declared", [1.0, 0.1, 0.0])
def test_what_a_receiver_declares_does_not_change_what_it_shows(declared: float) -> None:
    shown, usual = (Gnss(declared=share).measure(RIDE, TIMES, _rng()) for share in (declared, 1.0))
    assert (shown.values == usual.values).all()
    assert shown.variance == pytest.approx(np.full(TIMES.size, (declared * Gnss().std_m) ** 2))


def test_the_tacho_counts_the_turns_of_an_axle_that_slides() -> None:
    shown = TachoPosition(axle=0).measure(RIDE, TIMES, _rng()).values[:, 0]
    slid_m = SLID * np.maximum(_true(RIDE.journey.position_m) - SPEED_MPS * CRUISE_S, 0.0)
    assert shown == pytest.approx(SCALE * (_true(RIDE.journey.position_m) - slid_m), abs=0.15)
    rolled = TachoPosition(axle=1).measure(RIDE, TIMES, _rng()).values[:, 0]
    assert rolled == pytest.approx(SCALE * _true(RIDE.journey.position_m), abs=0.05)
    assert np.abs(np.diff(shown / 0.02) - np.round(np.diff(shown / 0.02))).max() < 1e-6


def test_doppler_is_white_with_a_small_correlated_part() -> None:
    errors = _errors(DOPPLER, _true(RIDE.journey.speed_mps))
    assert errors.std() == pytest.approx(np.hypot(0.05, 0.02), rel=0.02)
    assert np.mean(errors[:, 1:] * errors[:, :-1]) == pytest.approx(0.02**2 * np.exp(-0.1 / 5.0), rel=0.1)
    assert DOPPLER.measure(RIDE, TIMES, _rng()).variance == pytest.approx(np.full(TIMES.size, 0.05**2 + 0.02**2))


def test_radar_has_one_scale_for_a_journey_and_declares_it() -> None:
    true = _true(RIDE.journey.speed_mps)
    errors = _errors(RADAR, true, 400)
    scales = errors[:, ~BRAKED].mean(axis=1) / SPEED_MPS
    assert scales.std() == pytest.approx(0.01, rel=0.1)
    assert scales.mean() == pytest.approx(0.0, abs=0.0015)
    noise = errors - scales[:, np.newaxis] * true
    assert noise.std() == pytest.approx(0.1, rel=0.02)
    assert RADAR.measure(RIDE, TIMES, _rng()).variance == pytest.approx(0.1**2 + (0.01 * true) ** 2)
    assert not Speedometer(declared=0.0).measure(RIDE, TIMES, _rng()).variance.any()


def test_the_speed_of_an_axle_slides_with_it() -> None:
    for axle, creep in ((0, SLID), (1, 0.0)):
        speed = _true(RIDE.journey.wheel_radps[:, axle]) * NOMINAL.wheel_radius_m
        errors = _errors(TachoSpeed(axle=axle), speed)
        assert (errors[:, ~BRAKED] / speed[~BRAKED]).std() == pytest.approx(0.003, rel=0.02)
        expected = SCALE * (1.0 - creep) * (SPEED_MPS - BRAKING_MPS2 * 10.0)
        assert np.interp(CRUISE_S + 10.0, TIMES, speed + errors.mean(axis=0)) == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize(("of", "axle", "gauge_pa"), [(DEMANDED, 0, 300e3), (CYLINDER, 0, 150e3), (MEAN, 0, 262.5e3)])
def test_pressures_are_absolute_with_their_noise(of: str, axle: int, gauge_pa: float) -> None:
    shown = Pressure(of, axle, std_pa=2e3).measure(RIDE, TIMES, _rng())
    assert shown.values[BRAKED].mean() == pytest.approx(gauge_pa + 101_325.0, abs=400.0)
    assert shown.values[~BRAKED].mean() == pytest.approx(101_325.0, abs=300.0)
    assert shown.values[~BRAKED].std() == pytest.approx(2e3, rel=0.1)
    assert (shown.variance == 4e6).all()


@pytest.mark.parametrize("part", [0.5, 0.9])
def test_beside_an_electric_brake_cylinders_are_pressed_with_what_is_lacking(part: float) -> None:
    """Its part of the full brake at speed, nothing of it below 2 m/s; the demand is the same."""
    whole, lacking = (Pressure(MEAN, electric=each).measure(RIDE, TIMES, _rng()).values[:, 0] for each in (0.0, part))
    speed, less_pa = _true(RIDE.journey.speed_mps), part * RIDE.nominal.full_pa
    left_pa = np.mean([max(each - less_pa, 0.0) for each in (300e3, 300e3, 300e3, 150e3)])
    assert lacking[BRAKED & (speed > 6.0)].mean() - 101_325.0 == pytest.approx(left_pa, abs=400.0)
    assert lacking[speed < 2.0] == pytest.approx(whole[speed < 2.0])
    demanded, same = (Pressure(electric=each).measure(RIDE, TIMES, _rng()).values for each in (0.0, part))
    assert np.array_equal(demanded, same)


def test_an_unknown_pressure_is_refused() -> None:
    with pytest.raises(ValueError, match="pressure of = 'pipe': choose one of demanded, cylinder, mean"):
        Pressure("pipe")


def test_wheels_show_every_group_in_steps_with_noise_in_proportion() -> None:
    shown = Wheels(noise=0.003, resolution_radps=0.05).measure(RIDE, TIMES, _rng()).values
    true = np.column_stack([_true(speeds) for speeds in RIDE.journey.wheel_radps.T])
    assert shown.shape == (TIMES.size, GROUPS)
    assert np.abs(shown / 0.05 - np.round(shown / 0.05)).max() < 1e-6
    relative = (shown - true)[~BRAKED] / true[~BRAKED]
    assert relative.std() == pytest.approx(0.003, rel=0.05)
    assert np.abs(np.corrcoef(relative.T) - np.eye(GROUPS)).max() < 0.12


def test_one_group_at_a_time_drops_out_and_another_the_next_time() -> None:
    spells = Spells(every_s=5.0, shortest_s=2.0, longest_s=4.0)
    missing = np.isnan(Wheels(dropouts=spells).measure(RIDE, TIMES, _rng()).values)
    assert missing.sum(axis=1).max() == 1
    assert missing.any(axis=0).sum() > 1
    assert missing.any(axis=1).mean() == pytest.approx(3.0 / 8.0, abs=0.15)
    complete = Wheels().measure(RIDE, TIMES, _rng()).values
    assert (Wheels(dropouts=spells).measure(RIDE, TIMES, _rng()).values == complete)[~missing].all()


def test_some_groups_alone_may_have_a_tacho() -> None:
    """They show what they show where all of them have one."""
    every, rear = (Wheels(heard=heard).measure(RIDE, TIMES, _rng()).values for heard in ((0.0, 1.0), (0.5, 1.0)))
    assert np.array_equal(rear, every[:, -rear.shape[1] :])
    assert [list(Wheels(heard=heard).groups(count)) for heard, count in (((0.5, 0.5), 6), ((0.75, 1.0), 12))] == [
        [3],
        [9, 10, 11],
    ]


def test_an_accelerometer_feels_the_brake_the_nose_that_dips_and_not_the_grade() -> None:
    exact = Imu(0.0, 0.0, 0.0, 0.0).measure(RIDE, TIMES, _rng()).values[:, 0]
    uphill = GRAVITY * np.sin(np.arctan(GRADE))  # steady at speed: traction holds what the grade takes
    assert exact[~BRAKED][:-1] == pytest.approx(uphill)
    assert exact[BRAKED] == pytest.approx(-BRAKING_MPS2 + uphill - GRAVITY * PITCH_RAD, abs=1e-4)
    rolling_freely_downhill = specific_force(np.array([GRAVITY * 0.01]), np.array([-0.01]), np.zeros(1))
    assert rolling_freely_downhill == pytest.approx(0.0, abs=1e-4)


def test_an_accelerometer_errs_by_its_bias_that_walks_its_mounting_and_its_noise() -> None:
    exact = Imu(0.0, 0.0, 0.0, 0.0).measure(RIDE, TIMES, _rng()).values[:, 0]
    bias = _errors(Imu(bias_std_mps2=0.03, bias_walk=0.0, white_std_mps2=0.05, mounting_std_rad=0.0), exact, 400)
    assert bias.mean(axis=1).std() == pytest.approx(0.03, rel=0.1)
    assert bias.std(axis=1).mean() == pytest.approx(0.05, rel=0.02)
    walk = _errors(Imu(0.0, 0.001, 0.0, 0.0), exact, 400)
    assert walk[:, 1000].std() == pytest.approx(0.001 * np.sqrt(100.0), rel=0.1)
    assert np.abs(walk[:, 0]).max() == 0.0
    mounted = _errors(Imu(0.0, 0.0, 0.0, 0.003), exact, 400)
    assert mounted.mean(axis=1).std() == pytest.approx(0.003 * GRAVITY, rel=0.1)
    assert (Imu().measure(RIDE, TIMES, _rng()).variance == 0.05**2).all()


def test_every_sensor_repeats_itself_and_differs_by_seed() -> None:
    sensors = (Gnss(), GnssFix(Gnss()), TachoPosition(), DOPPLER, RADAR, TachoSpeed(), Pressure(), Wheels(), Imu())
    for sensor in sensors:
        first, again, other = (sensor.measure(RIDE, TIMES, _rng(seed)).values for seed in (1, 1, 2))
        assert np.array_equal(first, again, equal_nan=True)
        assert (first != other)[np.isfinite(first)].any()


def test_fixes_lie_on_the_line_of_the_file_and_err_along_and_beside_it(tmp_path: Path) -> None:
    (tmp_path / "track.geojson").write_text(geojson())
    line = read_track_line(str(tmp_path / "track.geojson"), BEGINS_M)
    true = _true(RIDE.journey.position_m)
    exact = GnssFix(Gnss(0.0, white_std_m=0.0)).measure(RIDE, TIMES, _rng())
    found = [line.place(latitude, longitude, 1.0, 25.0) for latitude, longitude, _ in exact.values[::20]]
    assert [place.along_m for place in found] == pytest.approx(true[::20], abs=0.05)
    assert max(place.cross_m for place in found) < 0.01
    shown = GnssFix(Gnss(2.0, 5.0, 0.1)).measure(RIDE, TIMES, _rng())
    found = [line.place(latitude, longitude, 1.0, 25.0) for latitude, longitude, _ in shown.values[::5]]
    assert np.std([place.along_m for place in found] - true[::5]) == pytest.approx(2.0, rel=0.3)
    assert np.sqrt(np.mean([place.cross_m**2 for place in found])) == pytest.approx(2.0, rel=0.3)
    assert shown.variance == pytest.approx(np.full(TIMES.size, 2.0**2 + 0.1**2))

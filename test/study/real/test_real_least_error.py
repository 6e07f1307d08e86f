# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The least error of mu, against a regression with the same unknowns, and where more is known."""

from __future__ import annotations

import numpy as np
import pytest

from adhesion_node.core.physics.train import GRAVITY
from adhesion_node.study.real.least_error import FACTOR_STD, FAR_M, FAST_MPS, STEP_S, Course, std_of
from sim_node.real.sensors.fitted import FITTED, Mounted
from sim_node.real.sensors.position import Gnss
from sim_node.real.sensors.speed import Speedometer
from sim_node.real.sensors.timing import Timing

COUNT, START = 150, 50
TIME_S = (np.arange(COUNT, dtype=np.float64) - START + 0.5) * STEP_S
COURSE = Course(
    TIME_S,
    np.full(COUNT, 30.0),
    np.where(TIME_S > 0.0, 0.08, 0.0),
    np.where(TIME_S > 0.0, 0.08, 0.0),
    (TIME_S > 2.0).astype(np.float64),
    [],
)
NO_SWINGS = np.zeros(COUNT)


@pytest.mark.parametrize("now", [70, 140])
@pytest.mark.parametrize("speeds", [False, True])
def test_without_swings_it_is_a_regression(now: int, speeds: bool) -> None:
    """The least squares of place, speed and factor, written as such, with what is known beforehand as three rows."""
    timing = Timing(rate_hz=1.0 / STEP_S)
    sensor = Speedometer(correlated_std_mps=0.0) if speeds else Gnss(0.0, white_std_m=0.5)
    slowing = np.where(TIME_S > 0.0, 0.08, 0.0) * GRAVITY * STEP_S
    lost = np.cumsum(slowing)
    time_s = TIME_S - TIME_S[0]
    rows = np.stack(
        [0 * time_s, 0 * time_s + 1, -lost] if speeds else [0 * time_s + 1, time_s, -STEP_S * np.cumsum(lost)]
    )
    rows = rows.T[: now + 1] / (0.05 if speeds else 0.5)
    information = rows.T @ rows + np.diag([FAR_M**-2, FAST_MPS**-2, FACTOR_STD**-2])
    expected = 0.08 * float(np.sqrt(np.linalg.inv(information)[2, 2]))
    assert std_of(COURSE, now, [Mounted(sensor, timing, "one")], NO_SWINGS) == pytest.approx(expected, rel=1e-6)


def test_swings_that_no_sensor_sees_in_time_stay() -> None:
    """White swings of 10 %: positions of half a metre tell little of the present second."""
    swings = np.zeros(COUNT)
    swings[0] = 0.01
    mounted = tuple(FITTED["white"].sensors.values())
    alone = 0.08 * 0.1 / np.sqrt(round(1.0 / STEP_S) + 1)
    assert std_of(COURSE, 140, mounted, swings) == pytest.approx(alone, rel=0.15)


@pytest.mark.parametrize(("more", "fewer"), [("gnss_doppler", "gnss"), ("gnss_imu", "gnss"), ("gnss", "gnss_1hz")])
def test_who_measures_more_knows_more(more: str, fewer: str) -> None:
    swings = 0.03**2 * np.exp(-np.arange(COUNT) * STEP_S / 1.5)
    known = [std_of(COURSE, 120, tuple(FITTED[name].sensors.values()), swings) for name in (more, fewer)]
    assert known[0] < known[1]

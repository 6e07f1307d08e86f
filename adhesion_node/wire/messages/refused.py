# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Why a message is refused, and the checks that refuse it."""

import math
from enum import Enum
from typing import Any

import numpy as np

from ...core.intake.outcome import text_of
from ...core.intake.samples import (
    MAX_ACCELERATION_MPS2,
    MAX_POSITION_M,
    MAX_SPEED_MPS,
    MAX_VARIANCE_M2,
    MIN_VARIANCE_M2,
)
from ...core.physics.train import Array
from ..line import ATMOSPHERE_PA, MAX_ABSOLUTE_PA, MIN_ABSOLUTE_PA, TRAIN

MAX_WHEEL_RADPS = 1e3
"""No wheel of a train turns faster: 500 km/h on a wheel of 0.3 m are 463 rad/s."""

MOST_AXLES = 400
"""A train of 1500 m has no more: axles are kept for seconds, and nobody is to fill the memory with them."""

MOST_POINTS = 2000
"""Of a braking curve: one in 0.07 m/s from 500 km/h on."""

MAX_FORCE_N = 1e7
"""No train pulls harder; the strongest locomotives reach 2 MN."""


class Reason(Enum):
    """Why a message was refused; the value is the remedy."""

    WRONG_FRAME = "set header.frame_id, or the reader's parameter frame, so that both agree"
    NOT_FINITE = "give a finite number, or publish nothing while there is none"
    BAD_VARIANCE = (
        f"give covariance[0] in SI units squared, {MIN_VARIANCE_M2:g} to {MAX_VARIANCE_M2:g};"
        " a sensor's position may have 0 where unknown"
    )
    IMPLAUSIBLE_POSITION = f"position is in m along the track, within +-{MAX_POSITION_M:g}"
    NO_FIX = "the receiver has no fix: nothing is used until it has one"
    IMPLAUSIBLE_FIX = "latitude is in degrees, within +-90, longitude within +-180"
    NO_TRACK_LINE = "set track_line to a GeoJSON or CSV file with the centre line of the track"
    OFF_TRACK = (
        "is track_line that of this way, does it reach beyond the ends of the way, are latitude and longitude "
        "exchanged? Raise max_cross_track_m only if the line or the receiver is that poor"
    )
    AMBIGUOUS = "the line comes by twice: nothing is used here; give each way or direction a track_line of its own"
    SWITCHED_OFF = "set it to true to use this sensor"
    OTHER_SOURCE = "another topic gives the positions: name the one that shall in position_source"
    IMPLAUSIBLE_PRESSURE = (
        f"fluid_pressure is absolute, in Pa, {MIN_ABSOLUTE_PA:g} to {MAX_ABSOLUTE_PA:g}: "
        f"add {ATMOSPHERE_PA:g} Pa to a gauge pressure, or the pressure of your air, and set ambient_pressure_pa "
        "to that; multiply kPa by 1000 and bar by 100000"
    )
    IMPLAUSIBLE_SPEED = f"speed is in m/s, not km/h, within +-{MAX_SPEED_MPS:g}"
    NO_ACCELERATION = "linear_acceleration_covariance[0] = -1 says that none is measured: give it, or publish no imu"
    IMPLAUSIBLE_ACCELERATION = (
        f"linear_acceleration.x is in m/s^2 along the track, not in g, within +-{MAX_ACCELERATION_MPS2:g}"
    )
    ACCELERATION_UNIT = (
        "that is no gravity in m/s^2, where it is 9.8: multiply g by 9.80665, mg by 0.00980665; left out until then"
    )
    GRAVITY_ALONG = (
        "no train gains or loses speed so for long: x is to point forward along the track, level, in m/s^2; "
        "left out until it does"
    )
    NO_AXLE = "give one velocity, rad/s, for every driven axle in name"
    MANY_AXLES = f"give at most {MOST_AXLES}, of the axles that have a sensor"
    IMPLAUSIBLE_WHEEL_SPEED = f"velocity is in rad/s, not rpm, within +-{MAX_WHEEL_RADPS:g}"
    IMPLAUSIBLE_FORCE = f"force.x is in N, within +-{MAX_FORCE_N:g}"
    UNDECODABLE = "leave it out of the recording, as `recover --drop-undecodable` does"
    DISABLED = "call ~/set_enabled with true to go on"
    BAD_CURVE = (
        f"give one joint '{TRAIN}', 2 to {MOST_POINTS} points, each with one position, velocity and acceleration; "
        "positions and times rise, speeds fall and are not negative, accelerations are below 0"
    )
    BAD_TARGET = f"give one joint '{TRAIN}' and one point with one position, m, and one velocity, m/s"
    IMPLAUSIBLE_CURVE = (
        "between two points v^2 falls by 2 a ds: give positions in m, velocities in m/s, accelerations in m/s^2"
    )


class Rejected(ValueError):
    """A message that must not be used: `reason` is the name of a `Reason`, the text says what = value: remedy."""

    def __init__(self, reason: Reason, what: str) -> None:
        super().__init__(f"{text_of(what)}: {reason.value}")
        self.reason = reason.name


def finite(what: str, value: Any) -> float:
    """Return a finite number; raises Rejected."""
    number = float(value)
    if not math.isfinite(number):
        raise Rejected(Reason.NOT_FINITE, f"{what} = {number}")
    return number


def plausible(what: str, value: Any, reason: Reason, most: float, least: float | None = None) -> float:
    """Return a finite number from `least`, else -`most`, to `most`; raises Rejected."""
    number = finite(what, value)
    if not (-most if least is None else least) <= number <= most:
        raise Rejected(reason, f"{what} = {number:g}")
    return number


def within(values: Array, most: float, least: float | None = None) -> Any:
    """Return those numbers that `plausible` returns, NaN in the place of others."""
    return np.where((values >= (-most if least is None else least)) & (values <= most), values, np.nan)


def whole(*columns: Array) -> list[Any]:
    """Return the numbers of many messages, all of a message NaN where one of them is."""
    known = np.isfinite(columns).all(axis=0)
    return [np.where(known, column, np.nan) for column in columns]

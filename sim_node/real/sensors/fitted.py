# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Sets of sensors by name, as a train may be fitted with them."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

from adhesion_node.wire.topics import BRAKE_DEMAND, BRAKE_PRESSURE, SPEED

from .imu import Imu
from .position import Gnss, GnssFix, TachoPosition
from .pressure import CYLINDER, DEMANDED, MEAN, Pressure
from .sensor import Sensor
from .speed import DOPPLER, RADAR, SMOOTHED, TachoSpeed
from .timing import Spells, Timing
from .wheels import Wheels


class Mounted(NamedTuple):
    """A sensor in the train; those of one `device` measure at the same moments, with the same outages."""

    sensor: Sensor
    timing: Timing
    device: str


class Fitted(NamedTuple):
    """The sensors of a train by name: a sensor of the same name has the same errors in every set that has it."""

    description: str
    sensors: Mapping[str, Mounted]

    @property
    def told(self) -> dict[str, str]:
        """What an estimator has to be told of them, by setting: messages do not say it."""
        by_topic = {mounted.sensor.topic: name.split()[-1] for name, mounted in self.sensors.items()}
        kinds = (("pressure_kind", BRAKE_PRESSURE), ("speed_source", SPEED))
        return {setting: by_topic[topic] for setting, topic in kinds if topic in by_topic}


_OUTAGES = Spells(every_s=15.0)
_MINUTES = Spells(every_s=20.0, shortest_s=60.0, longest_s=180.0)
_BUS = Timing()
_RECEIVER = Timing(latency_s=0.05, jitter_s=0.1)
_TUNNELS = replace(_RECEIVER, outages=_MINUTES)


def _gnss(sensor: Gnss | None = None, timing: Timing = _RECEIVER) -> dict[str, Mounted]:
    return {"position": Mounted(sensor or Gnss(), timing, "receiver")}


def _pressure(of: str) -> dict[str, Mounted]:
    return {f"pressure {of}": Mounted(Pressure(of), _BUS, "brake")}


_WHITE = {"position": Mounted(Gnss(0.0, white_std_m=0.5), _BUS, "receiver")}
_FIX = {"fix": Mounted(GnssFix(Gnss()), _RECEIVER, "receiver")}
_TACHO = {"tacho": Mounted(TachoPosition(), _BUS, "tacho")}
_TACHO_1HZ = {"tacho": Mounted(TachoPosition(), Timing(rate_hz=1.0), "tacho")}
_DOPPLER = {"speed doppler": Mounted(DOPPLER, _RECEIVER, "receiver")}
_SMOOTHED = {"speed smoothed doppler": Mounted(SMOOTHED, _RECEIVER, "receiver")}
_RADAR = {"speed radar": Mounted(RADAR, _BUS, "radar")}
_AXLE = {"speed axle": Mounted(TachoSpeed(), _BUS, "tacho")}
_IMU = {"imu": Mounted(Imu(), Timing(rate_hz=50.0), "imu")}
_WHEELS = {"wheels": Mounted(Wheels(), _BUS, "slide protection")}
_PATCHY_WHEELS = {"wheels": Mounted(Wheels(dropouts=Spells(15.0, 5.0, 70.0)), _BUS, "slide protection")}
_ONE_AXLE = {"wheels": Mounted(Wheels(heard=(0.5, 0.5)), _BUS, "slide protection")}
_REAR_WHEELS = {"wheels": Mounted(Wheels(heard=(0.75, 1.0)), _BUS, "slide protection")}
_WHEELS_1HZ = {"wheels": Mounted(Wheels(), Timing(rate_hz=1.0), "slide protection")}
_HANDLE = {"handle": Mounted(Pressure(DEMANDED, topic=BRAKE_DEMAND), _BUS, "handle")}
_DEMANDED, _CYLINDER, _MEAN = map(_pressure, (DEMANDED, CYLINDER, MEAN))
_BLENDED = {"pressure blended mean": Mounted(Pressure(MEAN, electric=0.7), _BUS, "brake")}

_RECORDED = Gnss(4.0, 1800.0, 0.08)
"""Two such receivers differ by 0.11 m of white, 1.4 m over 60 s, 6 m over a trip, as two on an intercity train did."""

_LATE = replace(_RECEIVER, latency_s=0.3, history_s=4.0)
_STAMPS = replace(_RECEIVER, stamp_error_s=1.0, stamp_errors=_MINUTES)

FITTED: Mapping[str, Fitted] = MappingProxyType(
    {
        name: Fitted(description, {key: one for sensors in fitted for key, one in sensors.items()})
        for name, description, *fitted in (
            ("white", "positions with white noise of 0.5 m, the demanded pressure", _WHITE, _DEMANDED),
            ("gnss", "satellites: 2 m over 30 s and 0.1 m white; the demanded pressure", _gnss(), _DEMANDED),
            (
                "gnss_recorded",
                "satellites as recorded: 4 m in half an hour",
                _gnss(_RECORDED),
                _DEMANDED,
            ),
            ("gnss_wheels", "satellites and the wheels", _gnss(), _DEMANDED, _WHEELS),
            ("one_axle", "satellites and one axle in the middle of the train", _gnss(), _DEMANDED, _ONE_AXLE),
            ("rear_wheels", "satellites and the axles of its last quarter", _gnss(), _DEMANDED, _REAR_WHEELS),
            ("wheels_1hz", "satellites, and the wheels once a second", _gnss(), _DEMANDED, _WHEELS_1HZ),
            ("gnss_doppler", "satellites with the receiver's speed", _gnss(), _DEMANDED, _DOPPLER),
            ("gnss_smoothed", "satellites with a speed that the receiver smooths", _gnss(), _DEMANDED, _SMOOTHED),
            ("gnss_imu", "satellites and an accelerometer", _gnss(), _DEMANDED, _IMU),
            ("gnss_sure", "a receiver that declares a tenth of its error", _gnss(Gnss(declared=0.1)), _DEMANDED),
            ("gnss_zero_covariance", "a receiver that declares nothing", _gnss(Gnss(declared=0.0)), _DEMANDED),
            ("gnss_outages", "2 to 10 s without a fix", _gnss(timing=replace(_RECEIVER, outages=_OUTAGES)), _DEMANDED),
            ("gnss_1hz", "one fix in a second", _gnss(timing=replace(_RECEIVER, rate_hz=1.0)), _DEMANDED),
            ("gnss_late", "fixes 0.3 to 0.4 s late, the first 4 s at once", _gnss(timing=_LATE), _DEMANDED),
            ("gnss_stamps", "stamps off by 1 s for minutes", _gnss(timing=_STAMPS), _DEMANDED),
            ("fix", "latitude and longitude on a track line, and the wheels", _FIX, _DEMANDED, _WHEELS),
            ("radar", "satellites and a radar", _gnss(), _DEMANDED, _RADAR),
            ("axle_speed", "satellites and the speed of an axle that slides", _gnss(), _DEMANDED, _AXLE),
            ("doppler_only", "the receiver's speed, no position", _DOPPLER, _DEMANDED),
            ("tacho", "the position of an axle that slides", _TACHO, _DEMANDED),
            ("tacho_1hz", "the same once a second", _TACHO_1HZ, _DEMANDED),
            ("tacho_wheels", "the position of an axle that slides, and the wheels", _TACHO, _DEMANDED, _WHEELS),
            ("one_cylinder", "satellites, the pressure of one cylinder", _gnss(), _CYLINDER),
            ("one_cylinder_wheels", "the same and the wheels", _gnss(), _CYLINDER, _WHEELS),
            ("mean_cylinder", "satellites, the mean pressure of the cylinders", _gnss(), _MEAN),
            ("mean_cylinder_wheels", "the same and the wheels", _gnss(), _MEAN, _WHEELS),
            ("mean_cylinder_demand", "the same and the demand, no wheels", _gnss(), _MEAN, _HANDLE),
            (
                "electric_demand",
                "an electric brake gives 70 %, the cylinders the rest; the demand, and the wheels",
                _gnss(),
                _BLENDED,
                _HANDLE,
                _WHEELS,
            ),
            ("electric_alone", "the same with an accelerometer, neither demand nor wheels", _gnss(), _BLENDED, _IMU),
            ("wheel_dropouts", "one bogie's wheels after the other missing", _gnss(), _MEAN, _PATCHY_WHEELS),
            ("tunnel_wheels", "minutes without a fix, and the wheels", _gnss(timing=_TUNNELS), _DEMANDED, _WHEELS),
            ("no_pressure", "satellites alone", _gnss()),
            ("full", "satellites with speed, accelerometer, wheels", _gnss(), _DOPPLER, _IMU, _WHEELS, _MEAN),
        )
    }
)
"""The sets by name."""

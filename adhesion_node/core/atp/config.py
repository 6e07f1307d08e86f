# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Settings of the supervision: target, delays and margins, named and defined as in SUBSET-026-3, section 3.13."""

from dataclasses import dataclass

from ..physics.train import KMH
from ..setting import check_settings, setting

MAX_ACCELERATION_CUT_OFF = 0.4
"""Largest acceleration, m/s^2, that is assumed once the traction is cut off, A_est2 (3.13.9.3.2.9)."""

INDICATION_LEAST_S, INDICATION_SHARE = 5.0, 0.8
"""T_indication is the larger of 5 s and 0.8 T_bs, plus T_driver (3.13.9.3.6.2)."""


@dataclass(frozen=True, slots=True)
class SupervisionConfig:
    """What is supervised and with which delays; `T_...`, `V_...` and `A_...` are the names of SUBSET-026.

    Raises ValueError naming the setting, its value and the remedy.
    """

    target_position_m: float = setting(6000.0, "Place of the target along the track", "m", -1e7, 1e7)
    target_speed_kmh: float = setting(100.0, "Speed allowed at the target; 0: the train must stop", "km/h", 0.0, 500.0)
    line_speed_kmh: float = setting(350.0, "Speed allowed before the target, V_MRSP", "km/h", 1.0, 500.0)
    emergency_build_up_s: float = setting(1.5, "Emergency brake build-up time, T_be", "s", 0.0, 60.0)
    service_build_up_s: float = setting(2.0, "Service brake build-up time, T_bs", "s", 0.0, 60.0)
    service_deceleration_mps2: float = setting(
        0.7, "Full service brake deceleration; never taken as more than the emergency brake's", "m/s^2", 0.01, 5.0
    )
    traction_cut_off_s: float = setting(
        1.0, "Time from the warning until the traction is off, T_traction_cut_off", "s", 0.0, 60.0
    )
    warning_time_s: float = setting(2.0, "Time from the warning to the service brake, T_warning", "s", 0.0, 60.0)
    driver_time_s: float = setting(
        4.0, "Time that the driver has from the permitted speed to the service brake, T_driver", "s", 0.0, 60.0
    )
    acceleration_mps2: float = setting(
        0.4,
        "Acceleration since the state and until the brake acts, A_est; from the cut-off on at most 0.4",
        "m/s^2",
        0.0,
        2.0,
    )
    speed_margin_mps: float = setting(0.5, "Margin for a speed that is estimated too low, V_delta0", "m/s", 0.0, 10.0)
    position_margin_m: float = setting(
        5.0, "Margin for a position that is estimated too far back (max safe front end)", "m", 0.0, 1e4
    )
    margin_sigma: float = setting(
        3.0, "Standard deviations of the state by which the train may be further ahead and faster", "", 0.0, 10.0
    )
    max_position_std_m: float = setting(
        20.0, "Standard deviation of the position up to which a state is used", "m", 1e-3, 1e4
    )
    max_speed_std_mps: float = setting(
        2.0, "Standard deviation of the speed up to which a state is used", "m/s", 1e-3, 50.0
    )
    roll_back_tolerance_m: float = setting(
        2.0, "Way that the train may roll back, beyond what the standard deviations explain", "m", 0.0, 1e3
    )
    max_deceleration_mps2: float = setting(
        3.0, "Deceleration up to which a braking curve is believed; no train brakes harder", "m/s^2", 0.1, 20.0
    )
    valid_for_s: float = setting(2.0, "Age up to which a curve and a state are used", "s", 0.01, 3600.0)
    max_ahead_s: float = setting(
        0.1, "How far a stamp may be ahead of the clock: so much way may be missed", "s", 0.0, 10.0
    )

    def __post_init__(self) -> None:
        check_settings(self, "")
        if self.driver_time_s < self.warning_time_s:
            least = f"warning_time_s = {self.warning_time_s!r}"
            raise ValueError(f"driver_time_s = {self.driver_time_s!r}: give at least {least}")
        if self.line_speed_kmh < self.target_speed_kmh:
            least = f"target_speed_kmh = {self.target_speed_kmh!r}"
            raise ValueError(f"line_speed_kmh = {self.line_speed_kmh!r}: give at least {least}")

    @property
    def target_speed_mps(self) -> float:
        """V_target."""
        return self.target_speed_kmh * KMH

    @property
    def line_speed_mps(self) -> float:
        """V_MRSP."""
        return self.line_speed_kmh * KMH

    @property
    def traction_s(self) -> float:
        """T_traction: how long the train still pulls after the emergency intervention (3.13.9.3.2.3 a)."""
        return max(self.traction_cut_off_s - (self.warning_time_s + self.service_build_up_s), 0.0)

    @property
    def coasting_s(self) -> float:
        """T_berem: from the end of the traction until the emergency brake is built up (3.13.9.3.2.6)."""
        return max(self.emergency_build_up_s - self.traction_s, 0.0)

    @property
    def speed_gain_pulling_mps(self) -> float:
        """V_delta1 (3.13.9.3.2.10)."""
        return self.acceleration_mps2 * self.traction_s

    @property
    def speed_gain_coasting_mps(self) -> float:
        """V_delta2 (3.13.9.3.2.10)."""
        return min(self.acceleration_mps2, MAX_ACCELERATION_CUT_OFF) * self.coasting_s

    @property
    def indication_s(self) -> float:
        """T_indication (3.13.9.3.6.2).

        >>> SupervisionConfig(service_build_up_s=10.0, driver_time_s=4.0).indication_s
        12.0
        """
        return max(INDICATION_SHARE * self.service_build_up_s, INDICATION_LEAST_S) + self.driver_time_s

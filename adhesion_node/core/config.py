# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Configuration of the estimator: one frozen dataclass whose fields carry their own description, unit and range."""

import math
from dataclasses import dataclass
from functools import partial

from .bank import BANK, SUMMARY
from .belief.rail_map import RailMap, Trust
from .methods import METHODS
from .physics.adhesion import LAWS, SpeedLaw
from .physics.motion import Motion
from .physics.track import LEVEL, Track
from .physics.train import CRH3, KMH, Train
from .setting import check_settings, setting

_method = partial(setting, group="method")
_rail = partial(setting, group="rail")
_steps = partial(setting, group="steps of the positions")
_motion = partial(setting, group="motion")
_wheels = partial(setting, group="speed and wheels")
_brake = partial(setting, group="brake")
_unsure = partial(setting, group="what is not known well")
_intake = partial(setting, group="intake")


NOISE_S = 0.1
"""Time over which the noise of the motion is told."""

SWINGING_M, SHORTEST_M = 200.0, 20.0
"""Length of the train whose `used_ripple` is told, and of one with as few axles as any."""


@dataclass(frozen=True, slots=True)
class Config:
    """Settings of the estimator; `Config()` is the default method at the nominal noise.

    Raises ValueError naming the setting, its value and its range.
    """

    train: Train = CRH3
    track: Track = LEVEL
    rail_map: RailMap | None = None
    """What earlier trains saw of the line; the bank begins a braking with it."""
    method: str = _method(
        BANK,
        "; ".join((f"{BANK}: {SUMMARY}", *(f"{name}: {method.summary}" for name, method in METHODS.items()))),
        choices=(BANK, *METHODS),
    )
    law: str = _method(
        "wet", "Adhesion law whose shape over speed the rail is taken to have", choices=tuple(sorted(LAWS))
    )
    law_probability: float = _method(
        0.3,
        "Probability of that shape, for the bank its square on a slippery rail; else of a part of that shape "
        "(rail_condition: low_adhesion's), or of none",
        low=0.0,
        high=1.0,
    )
    rail_drift: float = _rail(0.001, "Drift of the rail condition, relative standard deviation over 1 s", "", 0.0, 1.0)
    change_threshold: float = _rail(
        3.5, "Logarithm of the odds (evidence) from which the rail counts as changed within a window", low=0.0, high=1e6
    )
    change_edge: int = _rail(5, "Steps at either end of a window in which a change is not looked for", low=1, high=1000)
    change_margin: float = _rail(
        2.0,
        "By how much the log odds of a changed rail must exceed those of a step of the positions, or fall below them; "
        "else the next windows decide",
        low=0.0,
        high=1e6,
    )
    position_step_std_m: float = _steps(
        3.0, "By how much a balise may correct the positions, standard deviation", "m", 1e-3, 1e4
    )
    position_step_log_odds: float = _steps(
        5.0, "Log odds that such a step needs beyond change_threshold; heavy tails look like one", low=0.0, high=1e6
    )
    # swept over 0, 200, 500, 1000 m on positions from an axle that slides by turns and with a slow error of 2 m: least
    # error of the speed, while balises 600 m apart are still told
    position_step_spacing_m: float = _steps(
        200.0, "Distance behind such a step within which there is no other one", "m", 0.0, 1e6
    )
    position_step_speed_share: float = _steps(
        0.3,
        "Standard deviation of the speed behind such a step, over its size per time of the window",
        low=0.0,
        high=10.0,
    )
    restart_sigma: float = _steps(
        5.0,
        "Difference of its speed from the tracker's, in standard deviations, at which a window has lost the train",
        low=3.0,
        high=1e6,
    )
    restart_s: float = _steps(2.0, "Time after which such a window begins anew at the tracker", "s", 0.0, 60.0)
    limit_margin_sigma: float = _rail(
        2.0,
        "Standard deviations by which the rail condition must stay below the brake's limit for a step to tell of it",
        low=0.0,
        high=100.0,
    )
    shortest_window_s: float = _method(
        4.5,
        "Time up to which a window grows beyond S while it cannot tell adhesion from the brake's limit",
        "s",
        0.0,
        60.0,
    )
    tail_dof: float = _method(4.0, "Degrees of freedom of the positions' Student t; 0: Gaussian", low=0.0, high=1e6)
    identify_noise: bool = _method(
        False, "Identify the variance of the positions by the same EM, from the given one on"
    )
    noise_trust_steps: float = _method(50.0, "Steps of a window that the given variance is worth", low=1.0, high=1e9)
    noise_memory_steps: float = _method(1950.0, "Steps from which the variance is learnt at most", low=1.0, high=1e9)
    window: int = _method(50, "Measurements in a window, S", low=3, high=10_000)
    step: int = _method(5, "Measurements between two windows, L; less than the window", low=1, high=10_000)
    particles: int = _method(20, "Particles, M, of particle_em", low=2, high=100_000)
    iterations: int = _method(50, "EM iterations at most; particle_em mostly passes half as often", low=1, high=10_000)
    tolerance: float = _method(1e-6, "EM stops when mu moves less than this, epsilon of (34)", low=0.0, high=1.0)
    start_mu: float = _method(0.05, "Adhesion from which the first window starts", low=0.0, high=1.0)
    confidence: float = _method(0.95, "One-sided confidence of the lower bound", low=0.5, high=0.9999)
    curve_confidence: float = _method(
        0.99, "Probability that the way to the standstill is not longer than the safe curve", low=0.5, high=0.9999
    )
    position_noise_m: float = _motion(
        0.02, "Process noise of the position, standard deviation over 0.1 s", "m", 1e-6, 100.0
    )
    speed_noise_mps: float = _motion(
        0.02 * KMH, "Process noise of the speed under the brake, standard deviation over 0.1 s", "m/s", 1e-7, 10.0
    )
    coasting_noise_mps: float = _motion(
        0.03, "Random walk of the speed while no brake is applied, standard deviation over 0.1 s", "m/s", 1e-6, 10.0
    )
    braking_noise_mps: float = _motion(
        1.0,
        "The same under the brake, over 1 s, for the tracker: an unknown deceleration of about 1 m/s^2",
        "m/s",
        1e-3,
        10.0,
    )
    settled_ratio: float = _motion(
        1.5,
        "Variance of the tracker's speed, over its stationary value, from which on a window may open",
        low=1.0,
        high=100.0,
    )
    unknown_speed_mps: float = _motion(
        50.0, "Mean and standard deviation of the speed of a train just met", "m/s", 1.0, 200.0
    )
    slowest_mps: float = _motion(
        3.0, "Speed below which there are no windows: a train about to stand says nothing of the rail", "m/s", 0.1, 50.0
    )
    speed_source: str = _wheels(
        "axle",
        "What measures the speed: doppler (of GNSS) and radar are used under the brake too, an axle would slide",
        choices=("axle", "doppler", "radar"),
    )
    speed_std_mps: float = _wheels(
        0.3, "Standard deviation of a measured speed whose message tells no variance", "m/s", 1e-4, 100.0
    )
    imu_std_mps2: float = _wheels(
        0.05,
        "Standard deviation of a measured acceleration whose message tells no variance",
        "m/s^2",
        1e-4,
        100.0,
    )
    creep_samples: int = _wheels(10, "Newest measurements whose creep tells sliding wheels", low=1, high=1000)
    sliding_creep: float = _wheels(
        0.03,
        "Creep from which an axle slides; it rolls where no error lets its creep be twice that. In windows: creep of "
        "the median axle, and the wheels roll below half of it",
        low=1e-3,
        high=1.0,
    )
    brake_threshold_pa: float = _brake(
        10e3, "Brake-cylinder pressure (gauge) from which the brake counts as applied", "Pa", 0.0, 1e6
    )
    pressure_kind: str = _brake(
        "cylinder",
        "What brake_pressure tells: the pressure of one cylinder, the mean of all, or what is demanded of them",
        choices=("cylinder", "mean", "demanded"),
    )
    estimate_s: float = _method(0.5, "Time between two estimates of the bank", "s", 0.0, 60.0)
    brake_build_up_s: float = _brake(2.0, "Time in which the brake follows what is demanded of it", "s", 0.01, 60.0)
    assumed_pressure_pa: float = _brake(
        410e3, "Brake-cylinder pressure (gauge) taken where none is measured", "Pa", 0.0, 2e6
    )
    lowest_net_mu: float = _brake(
        -0.05, "Least net adhesion where no pressure is measured: traction may be at work", low=-1.0, high=0.0
    )
    pressure_wait_s: float = _intake(
        0.2, "How long, by the stamps, a position waits for the pressure and the speed of its time", "s", 0.0, 60.0
    )
    pressure_age_s: float = _intake(2.0, "Age from which a measured pressure counts as none", "s", 1e-3, 60.0)
    used_ripple: float = _unsure(
        0.025,
        "By how much the adhesion that a train of 200 m uses swings within a second, as slide protection works in "
        "turns, relative; the fewer axles, the more: it goes with 1/sqrt(length)",
        "",
        0.0,
        1.0,
    )
    brake_drift: float = _unsure(
        0.005, "Drift of the true over the expected brake force, standard deviation over 1 s", "", 0.0, 1.0
    )
    ahead_std: float = _unsure(
        0.08,
        "By how much the adhesion, or the brake's force, comes to differ over 2 km of the way ahead, relative",
        "",
        0.0,
        1.0,
    )
    speed_scale_std: float = _unsure(0.01, "Standard deviation of the scale of measured speeds", "", 0.0, 0.5)
    grade_std: float = _unsure(
        0.008, "Standard deviation of the grade, rise over run, that the track profile leaves open", "", 0.0, 0.1
    )
    profile_std: float = _unsure(
        0.0004, "The same where the track profile has sections: what it leaves open of the grade", "", 0.0, 0.1
    )
    resistance_std: float = _unsure(0.12, "Standard deviation of the running resistance, relative", "", 0.0, 1.0)
    mass_std: float = _unsure(0.05, "Standard deviation of the mass, relative", "", 0.0, 1.0)
    brake_std: float = _unsure(0.1, "Standard deviation of the brake force, relative", "", 0.0, 1.0)
    rotating_mass_std: float = _unsure(0.02, "Standard deviation of the rotating mass fraction", "", 0.0, 1.0)
    low_adhesion: str = _method(
        "snow", "Adhesion law to fall back to where nothing is known", choices=tuple(sorted(LAWS))
    )
    lowest_mu: float = _rail(
        0.02, "Adhesion that is counted on where nothing is known; less is rare even on leaves", low=0.0, high=1.0
    )
    undecided_share: float = _rail(
        0.5, "Share of unknown_std above which a window has seen too little to tell what limits", low=0.0, high=10.0
    )
    undecided_start_share: float = _rail(
        0.5, "Share of its start left in particle_em's mu above which it has seen too little", low=0.0, high=1.0
    )
    plausible_probability: float = _rail(
        0.005, "Probability from which a shape of the law may lower the bound", low=0.0, high=1.0
    )
    unknown_std: float = _rail(0.04, "Standard deviation of mu where nothing is known", low=1e-3, high=1.0)
    memory_s: float = _rail(60.0, "Time in which knowledge that is not renewed fades to 1/e", "s", 1e-3, 1e6)
    rail_map_days: float = _rail(
        0.5, "Time in which it fades to 1/e that the rail is as earlier trains saw it", "days", 1e-3, 1e4
    )
    rail_map_trust: float = _rail(
        0.9, "Probability that the rail is as earlier trains saw it just now; 0: a map is not used", low=0.0, high=1.0
    )
    memory_m: float = _rail(3000.0, "Distance over which it fades to 1/e", "m", 1e-3, 1e7)
    max_lag_s: float = _intake(
        0.0, "How late a measurement may come and still be sorted in; results wait as long", "s", 0.0, 60.0
    )
    max_gap_s: float = _intake(2.0, "Longest gap between measurements that a window may bridge", "s", 1e-3, 60.0)
    reset_s: float = _intake(60.0, "Jump of the stamps, either way, that starts the estimation anew", "s", 1.0, 1e6)
    tick_s: float = _intake(
        0.25,
        "Without a position for so long, by the stamps, the other sensors are used without one; 0: never",
        "s",
        0.0,
        60.0,
    )
    tick_for_s: float = _intake(
        600.0, "For how long they are so used behind the last position, speed and wheel speed", "s", 0.0, 3600.0
    )
    gate_sigma: float = _intake(
        6.0, "Innovation in standard deviations from which a position is an outlier", low=3.0, high=1e6
    )
    max_outliers: int = _intake(
        20, "Outliers in a row after which the train is taken to be elsewhere", low=1, high=10_000
    )

    def __post_init__(self) -> None:
        check_settings(self, "")
        if not isinstance(self.train, Train):
            raise ValueError(f"train = {self.train!r}: give a Train, such as Train(mass_kg=400e3)")
        if not isinstance(self.track, Track):
            raise ValueError(f"track = {self.track!r}: give a Track, such as Track((Grade(0.0, 2000.0, 10.0),))")
        if not isinstance(self.rail_map, RailMap | None):
            raise ValueError(f"rail_map = {self.rail_map!r}: give a RailMap, or None")
        if self.rail_map is not None and self.method != BANK:
            raise ValueError(f"rail_map with method = {self.method}: only {BANK} begins with a map, leave one out")
        if self.step >= self.window:
            raise ValueError(f"step = {self.step}: choose less than the window, {self.window}")

    @property
    def speed_law(self) -> SpeedLaw:
        """The law that the rail condition scales."""
        return LAWS[self.law]

    @property
    def low_law(self) -> SpeedLaw:
        """The low-adhesion law."""
        return LAWS[self.low_adhesion]

    @property
    def brake_error(self) -> float:
        """Standard deviation of the most that the brake can use, B/(M g), relative."""
        rotating = self.rotating_mass_std / (1.0 + self.train.rotating_mass_fraction)
        return math.hypot(self.mass_std, self.brake_std, rotating)

    @property
    def least_pressure_pa(self) -> float:
        """Gauge pressure from which the brake counts as applied, Pa; some pascals are none."""
        return max(self.brake_threshold_pa, 1.0)

    @property
    def ripple(self) -> float:
        """`used_ripple` of this train, relative; of a shorter one than `SHORTEST_M` no more than of that."""
        return self.used_ripple * math.sqrt(SWINGING_M / max(self.train.length_m, SHORTEST_M))

    @property
    def grade_error(self) -> float:
        """Standard deviation of the grade, rise over run."""
        return self.profile_std if self.track.sections else self.grade_std

    @property
    def map_trust(self) -> Trust:
        """How far the map of the rail is believed."""
        return Trust(self.rail_map_trust, self.rail_map_days)

    @property
    def motion(self) -> Motion:
        """The train's state-space model with the configured noise."""
        return Motion(self.train, self.track, self.position_noise_m**2 / NOISE_S, self.speed_noise_mps**2 / NOISE_S)

    def speed_noise_rate(self, braked: bool) -> float:
        """Variance rate of the tracker's speed, (m/s)^2/s."""
        return self.braking_noise_mps**2 if braked else self.coasting_noise_mps**2 / NOISE_S

    def brake(self, pressure_pa: float | None) -> float:
        """Brake B/(M g) of a measured gauge pressure; 0 below the threshold, the assumed one without a measurement."""
        pressure = self.assumed_pressure_pa if pressure_pa is None else pressure_pa
        return self.train.specific_brake(pressure) if self.is_braked(pressure) else 0.0

    def is_braked(self, pressure_pa: float | None) -> bool:
        """Whether a measured gauge pressure, without one the assumed one, is above the threshold."""
        pressure = self.assumed_pressure_pa if pressure_pa is None else pressure_pa
        return pressure >= self.least_pressure_pa

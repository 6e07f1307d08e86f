# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The cases of `study real`: a train on its rail, and the sensors that it is fitted with."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from sim_node.real import known
from sim_node.real.drive import Drive, sense
from sim_node.real.plant.journey import Journey
from sim_node.real.plant.scenarios import SCENARIOS, Scenario
from sim_node.real.plant.simulate import simulate
from sim_node.real.plant.train import Nominal
from sim_node.real.sensors import centre_line
from sim_node.real.sensors.fitted import FITTED, Fitted
from sim_node.real.sensors.sensor import Ride

from ...core import Config
from ...core.physics.track import Grade, Track
from ...core.setting import Value, settings_of
from ...run.results.used import USED_S
from ...wire.line import NOMINAL, Line
from ...wire.settings.given import parse_setting
from ...wire.track_line import TrackLine, line_of
from . import point_mass

AIDED = ("gnss_doppler", "gnss_smoothed", "gnss_imu", "radar", "doppler_only", "full")
"""Sets with a speed of their own or an accelerometer."""

UNSOUND = ("tacho", "tacho_1hz", "gnss_outages", "gnss_stamps", "tunnel_wheels", "one_cylinder", "no_pressure")
"""Sets whose sensors cannot be trusted, or lack what a narrow answer needs."""

SLOWEST_BUILD_UP = 1.15
"""A train's brake may take so much longer to build up than its papers say."""


class Case(NamedTuple):
    """A line of the table."""

    scenario: str
    fitted: str
    told: tuple[tuple[str, Value], ...] = ()
    """Settings of the estimator that differ from what it is told else."""

    @property
    def name(self) -> str:
        """Of the line."""
        return f"{self.scenario} {self.fitted}"

    @property
    def rail(self) -> str:
        """What sets its goals: "leaves", "patches", or nothing."""
        if self.scenario.startswith("patch"):
            return "patches"
        return "leaves" if "leaves" in self.scenario or self.scenario == "salisbury" else ""

    @property
    def config(self) -> Config:
        """What the estimator is told: the train by its papers, the known grades, what its sensors are, not how good."""
        if self.scenario == point_mass.NAME:
            return replace(Config(track=Track((Grade(-known.LONG_M, known.LONG_M, 0.0),))), **dict[str, Any](self.told))
        return config_of(SCENARIOS[self.scenario], FITTED[self.fitted], self.told)

    @property
    def line(self) -> Line:
        """What its reader knows of the line: where fixes are projected, the track's centre line."""
        return Line(track=_centre_line()) if "fix" in FITTED[self.fitted].sensors else NOMINAL

    @property
    def built_after_s(self) -> float:
        """Time from the full demand until the brake has built up everywhere, and the mean of used is all behind it."""
        if self.scenario == point_mass.NAME:
            return USED_S / 2
        return built_after_s(SCENARIOS[self.scenario].nominal)

    def drives(self, seeds: Iterable[int]) -> tuple[Drive, ...]:
        """Drive every seed."""
        if self.scenario == point_mass.NAME:
            return point_mass.drives(seeds)
        nominal, journeys = SCENARIOS[self.scenario].nominal, _journeys(self.scenario, tuple(seeds))
        return tuple(Drive(journey, sense(Ride(journey, nominal), FITTED[self.fitted])) for journey in journeys)


def config_of(scenario: Scenario, fitted: Fitted, told: Iterable[tuple[str, Value]] = ()) -> Config:
    """What an estimator is told: the train by its papers, the known grades, what its sensors are; and `told`."""
    settings: dict[str, Any] = {**known.brake(scenario), **fitted.told, **dict(told)}
    return Config(known.train(scenario), known.track(scenario), **settings)


def built_after_s(nominal: Nominal) -> float:
    """Time from the full demand until the brake has built up everywhere, and the mean of used is all behind it."""
    return SLOWEST_BUILD_UP * nominal.build_up_s + nominal.length_m / nominal.propagation_mps + USED_S / 2


@cache
def _centre_line() -> TrackLine:
    along_m = np.arange(centre_line.BEGINS_M, centre_line.ENDS_M, centre_line.STEP_M)
    return line_of("the made-up track", *centre_line.places(along_m, 0.0 * along_m), None, centre_line.BEGINS_M)


@lru_cache(maxsize=6)  # the cases of a scenario follow each other and differ in their sensors alone
def _journeys(scenario: str, seeds: tuple[int, ...]) -> tuple[Journey, ...]:
    return simulate(SCENARIOS[scenario], seeds)


CASES = tuple(
    Case(scenario, fitted)
    for scenario, sets in (
        (point_mass.NAME, "white"),
        ("wet", "white gnss gnss_wheels gnss_doppler gnss_smoothed gnss_imu radar doppler_only tacho axle_speed"),
        ("wet", "gnss_recorded fix gnss_sure gnss_zero_covariance gnss_outages gnss_1hz gnss_late gnss_stamps full"),
        ("wet", "tunnel_wheels electric_demand electric_alone one_axle rear_wheels wheels_1hz tacho_1hz tacho_wheels"),
        ("wet_mass_over", "white gnss_wheels"),
        ("wet_pads_weak", "gnss_wheels"),
        ("wet_fast", "gnss_doppler"),
        ("undulating", "gnss_imu"),
        ("sequence", "gnss_wheels"),
        ("rotating", "gnss_doppler"),
        ("drying", "gnss_wheels"),
        ("mixed", "gnss_wheels"),
        ("dry", "gnss full electric_demand electric_alone one_axle"),
        ("dry_pads_weak", "white gnss_wheels"),
        ("dry_mass_over", "gnss_wheels"),
        ("dry_fast", "gnss_wheels"),
        ("undulating_dry", "gnss_wheels"),
        ("sequence_dry", "gnss_doppler"),
        ("leaves", "white gnss gnss_recorded gnss_wheels gnss_smoothed gnss_imu gnss_outages"),
        ("leaves", "one_cylinder one_cylinder_wheels mean_cylinder mean_cylinder_wheels mean_cylinder_demand"),
        ("leaves", "wheel_dropouts tunnel_wheels electric_demand electric_alone one_axle rear_wheels wheels_1hz"),
        ("leaves", "tacho_1hz tacho_wheels no_pressure full"),
        ("leaves_severe", "gnss_doppler"),
        ("wet_rough", "gnss gnss_wheels gnss_doppler"),
        ("wet_falls", "gnss gnss_wheels gnss_doppler"),
        ("leaves_rough", "gnss gnss_wheels gnss_doppler"),
        ("leaves_falls", "gnss gnss_wheels gnss_doppler"),
        ("sequence_leaves", "mean_cylinder mean_cylinder_wheels"),
        ("downhill_leaves", "gnss_wheels"),
        ("salisbury", "gnss_doppler"),
        ("patches", "gnss gnss_recorded gnss_wheels full"),
        ("patch_fall", "gnss_doppler"),
        ("metro_dry", "gnss_wheels"),
        ("metro_wet", "gnss_wheels"),
        ("metro_leaves", "gnss_doppler"),
        ("freight_dry", "gnss"),
        ("freight_wet", "gnss_doppler"),
        ("freight_leaves", "gnss"),
        ("tram_dry", "gnss_wheels"),
        ("tram_wet", "full tacho"),
        ("tram_leaves", "gnss_wheels"),
    )
    for fitted in sets.split()
)
"""The lines of the table."""


def chosen(only: str, told: Sequence[str] = ()) -> tuple[Case, ...]:
    """The cases whose names hold one of the texts, separated by commas, with settings NAME=VALUE.

    Raises ValueError without any case, and for a setting that the estimator has not or that is out of its range.
    """
    others = tuple(parse_setting(text, settings_of(Config)) for text in told)
    wanted = [text.strip().lower() for text in only.split(",") if text.strip()]
    some = tuple(case for case in CASES if not wanted or any(text in case.name.lower() for text in wanted))
    if not some:
        raise ValueError(f"only = {only}: give parts of {'; '.join(case.name for case in CASES)}")
    return tuple(case._replace(told=others) for case in some)

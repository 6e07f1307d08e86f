# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The scenarios by name: a train, its scatter, the rail, the grade and what the driver asks for."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from .train import USUAL, Nominal, Scatter
from .way import LEVEL, Grade, Rail, along, patches, steady, undulating

KMH = 1.0 / 3.6

HIGH_SPEED = Nominal("high speed", 16, 430e3, 200.0, (2.6e3, 125.0, 7.7), 1.2, build_up_s=2.5)
INTERCITY = Nominal("multiple unit", 16, 380e3, 200.0, (3.5e3, 110.0, 9.0), 1.2, build_up_s=2.5)
REGIONAL = Nominal("regional unit", 12, 117e3, 69.0, (1.8e3, 35.0, 4.5), 1.2, rotating=0.05, wheel_radius_m=0.42)
METRO = Nominal("metro", 12, 210e3, 108.0, (2.5e3, 60.0, 7.0), 1.3, 0.06, 0.42, build_up_s=2.0)
FREIGHT = Nominal(
    "freight",
    20,
    2000e3,
    700.0,
    (20e3, 200.0, 40.0),
    0.235,
    0.03,
    0.46,
    build_up_s=14.0,
    propagation_mps=265.0,
    slide_protection=False,
)
TRAM = Nominal("tram", 6, 42e3, 32.0, (0.6e3, 10.0, 1.6), 1.3, 0.08, 0.30, build_up_s=1.0)
"""Resistances of the order that is published for such trains (TGV Reseau: 2540 + 33.4 V + 0.572 V^2 N, V in km/h)."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """A run from a steady cruise to the standstill."""

    name: str
    nominal: Nominal
    speed_mps: float
    """Of the cruise, which traction holds until the first demand."""
    rail: Rail
    demands: tuple[tuple[float, float], ...] = ((10.0, 1.0),)
    """(from time, s; share of the full pressure); the last is the full brake and holds to the end."""
    grade: Grade = LEVEL
    known_grade: tuple[tuple[float, float, float], ...] = ()
    """What may be told of the track: (from, m; to, m; rise over run)."""
    scatter: Scatter = USUAL
    way_m: float = 12e3


ROUGHER = 0.09
"""Roughness of a rail that is worse than the others."""


def _dry(level: float = 0.30, level_std: float = 0.10) -> Rail:
    return Rail(steady(level), level_std=level_std)


def _leaves(level: float = 0.042) -> Rail:
    return Rail(steady(level), cleaning=1.5, level_std=0.13)


_WETTED = Rail(steady(0.115), cleaning=1.3, level_std=0.08)
_UNIT = Scenario("dry", INTERCITY, 160 * KMH, _dry())
_WET = replace(_UNIT, name="wet", rail=_WETTED)
_LEAVES = replace(_UNIT, name="leaves", rail=_leaves())
_METRO = Scenario("metro_dry", METRO, 80 * KMH, _dry())
_TRAM = Scenario("tram_dry", TRAM, 50 * KMH, _dry())
_FREIGHT = Scenario("freight_dry", FREIGHT, 100 * KMH, _dry())
_STEPS = ((10.0, 0.35), (20.0, 0.55), (30.0, 0.0), (42.0, 1.0))
"""Service braking, release, coasting, full brake."""
SCENARIOS: Mapping[str, Scenario] = {
    scenario.name: scenario
    for scenario in (
        _UNIT,
        replace(_UNIT, name="dry_pads_weak", scatter=Scatter(pads=-0.15)),
        replace(_UNIT, name="dry_mass_over", scatter=Scatter(mass=0.2)),
        replace(_UNIT, name="dry_fast", nominal=HIGH_SPEED, speed_mps=300 * KMH, rail=_dry(0.38, 0.05)),
        _WET,
        replace(_WET, name="wet_fast", nominal=HIGH_SPEED, speed_mps=250 * KMH),
        replace(_WET, name="wet_mass_over", scatter=Scatter(mass=0.2)),
        replace(_WET, name="wet_pads_weak", scatter=Scatter(pads=-0.15)),
        _LEAVES,
        replace(_LEAVES, name="leaves_severe", rail=_leaves(0.027)),
        replace(_WET, name="wet_rough", rail=replace(_WETTED, roughness=ROUGHER)),
        replace(_WET, name="wet_falls", rail=replace(_WETTED, level=along((0.0, 0.125), (1600.0, 0.095)))),
        replace(_LEAVES, name="leaves_rough", rail=replace(_leaves(), roughness=ROUGHER)),
        replace(_LEAVES, name="leaves_falls", rail=replace(_leaves(), level=along((0.0, 0.048), (3500.0, 0.034)))),
        replace(
            _UNIT,
            name="patches",
            rail=Rail(patches(0.115, 0.045, (300.0, 1000.0), (200.0, 800.0)), cleaning=1.3, level_std=0.08),
        ),
        replace(_UNIT, name="patch_fall", rail=Rail(along((799.0, 0.30), (800.0, 0.042)), cleaning=1.3)),
        replace(_UNIT, name="drying", rail=Rail(along((400.0, 0.075), (2200.0, 0.22)), cleaning=1.2)),
        replace(_WET, name="undulating", grade=undulating(0.008)),
        replace(_UNIT, name="undulating_dry", grade=undulating(0.008)),
        replace(
            _LEAVES, name="downhill_leaves", grade=steady(-0.008), known_grade=((-1000.0, 20000.0, -0.008),), way_m=20e3
        ),
        replace(_WET, name="sequence", demands=_STEPS),
        replace(_UNIT, name="sequence_dry", demands=_STEPS),
        replace(_LEAVES, name="sequence_leaves", demands=_STEPS),
        replace(
            _UNIT,
            name="mixed",
            rail=Rail(steady(0.172), cleaning=1.5, level_std=0.03),
            scatter=Scatter(mass=0.0, pads=0.0),
        ),
        replace(_WET, name="rotating", scatter=Scatter(rotating=0.08)),
        Scenario("salisbury", REGIONAL, 138 * KMH, _leaves(0.0208)),
        replace(_METRO, name="metro_wet", rail=_WETTED),
        replace(_METRO, name="metro_leaves", rail=_leaves()),
        _METRO,
        _FREIGHT,
        replace(_FREIGHT, name="freight_wet", rail=_WETTED),
        replace(_FREIGHT, name="freight_leaves", rail=_leaves(0.024)),
        replace(_TRAM, name="tram_wet", rail=_WETTED),
        replace(_TRAM, name="tram_leaves", rail=_leaves()),
        _TRAM,
    )
}
"""The scenarios by name."""

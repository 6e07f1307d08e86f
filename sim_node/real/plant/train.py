# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Trains: what the papers of one say (`Nominal`), and what a single train on a single day is (`Train`)."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .compiled import formula
from .journey import Array


@dataclass(frozen=True, slots=True)
class Nominal:
    """A type of train by its papers: all that an onboard unit is told of it."""

    name: str
    groups: int
    """Axle groups: bogies, or the axles of a short train."""
    mass_kg: float
    """With the usual load."""
    length_m: float
    resistance: tuple[float, float, float]
    """Running resistance c0 + c1 v + c2 v^2 in N, N s/m, N s^2/m^2."""
    deceleration_mps2: float
    """What the full brake alone gives on a level track where it sticks: force over (1 + rotating) mass."""
    rotating: float = 0.04
    """Rotating mass over mass."""
    wheel_radius_m: float = 0.46
    """Of a new wheel."""
    full_pa: float = 380e3
    """Gauge pressure in the cylinders at the full brake."""
    build_up_s: float = 2.5
    """Time in which a group's pressure rises from 0 to the full one; it rises steadily."""
    propagation_mps: float = np.inf
    """Speed at which the brake command runs along the train."""
    slide_protection: bool = True
    protection_creep: float = 1.0
    """Creep up to which its slide protection lets axles slide, over that of the usual one."""

    @property
    def brake_n(self) -> float:
        """Force of the full brake at the rims."""
        return self.deceleration_mps2 * (1.0 + self.rotating) * self.mass_kg

    def offsets(self) -> Array:
        """Return how far behind the front the groups are, m, shape (A,)."""
        return np.asarray((np.arange(self.groups) + 0.5) * (self.length_m / self.groups), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Scatter:
    """How far a train may be from its papers: standard deviations, or values that a scenario forces.

    What is drawn stays within the ranges that are met in service: mass -10 to +20 %, resistance +-20 %, pads +-15 %
    in all and as much over the speed, single pads +-4 %, rotating mass 0 to 8 %, wheels up to 3 % worn.
    """

    mass_std: float = 0.05
    resistance_std: float = 0.1
    pads_std: float = 0.05
    rotating_std: float = 0.01
    """Of the rotating mass over the mass."""
    mass: float | None = None
    """True mass over the nominal one, minus 1."""
    pads: float | None = None
    """Friction of all pads over the nominal one, minus 1."""
    rotating: float | None = None


USUAL = Scatter()


class Train(NamedTuple):
    """A train as it is; shape (A,) by axle group, or none. Runs side by side are stacked: (R, A) and (R, 1)."""

    mass_kg: Array
    resistance: Array
    """Factor on the nominal running resistance."""
    wheel_kg: Array
    """Rotating mass of a group, J/r^2."""
    radius_m: Array
    pad_n_per_pa: Array
    """Brake force at the rim by cylinder pressure, at half of `FADE_MPS`."""
    fade: Array
    """Friction of the pads grows by this share from 0 m/s to `FADE_MPS`, and no more above."""
    dump_s: Array
    """Time constant of the emptying cylinder."""
    rise_pa_per_s: Array
    build_up_s: Array
    pitch_rad_per_mps2: Array


FADE_MPS = 30.0
"""Speed up to which the pads' friction changes."""


def draw(nominal: Nominal, scatter: Scatter, rng: np.random.Generator) -> Train:
    """Draw a single train. The same numbers are drawn whatever the scatter forces."""
    ones = np.ones(1)

    def around(std: float, low: float, high: float, forced: float | None = None) -> Array:
        drawn = float(np.clip(std * rng.standard_normal(), low, high))
        return ones * (drawn if forced is None else forced)

    mass = around(scatter.mass_std, -0.1, 0.2, scatter.mass)
    resistance = around(scatter.resistance_std, -0.2, 0.2)
    pads = around(scatter.pads_std, -0.15, 0.15, scatter.pads)
    fade = around(scatter.pads_std, -0.15, 0.15)
    rotating = nominal.rotating + around(scatter.rotating_std, -nominal.rotating, 0.08 - nominal.rotating)
    if scatter.rotating is not None:
        rotating = ones * scatter.rotating
    groups = nominal.groups
    wear = rng.uniform(-0.03, 0.0) + np.clip(0.003 * rng.standard_normal(groups), -0.006, 0.006)
    pad = rng.uniform(-0.04, 0.04, groups)
    dump, rise = rng.uniform(0.12, 0.22, groups), rng.uniform(500e3, 900e3, groups)
    build_up = nominal.build_up_s * rng.uniform(0.85, 1.15)
    pitch = np.deg2rad(rng.uniform(0.3, 1.0)) / 1.2
    return Train(
        mass_kg=nominal.mass_kg * (1.0 + mass),
        resistance=1.0 + resistance,
        wheel_kg=ones * rotating * nominal.mass_kg / groups,
        radius_m=nominal.wheel_radius_m * (1.0 + wear),
        pad_n_per_pa=nominal.brake_n / nominal.full_pa / groups * (1.0 + pads) * (1.0 + pad),
        fade=fade,
        dump_s=dump,
        rise_pa_per_s=rise,
        build_up_s=ones * build_up,
        pitch_rad_per_mps2=ones * pitch,
    )


def stack(trains: list[Train]) -> Train:
    """Put R trains side by side."""
    return Train(*(np.array(values) for values in zip(*trains, strict=True)))


def brake_n(train: Train, cylinder_pa: Array, speed_mps: Array) -> Array:
    """Return the brake force of the groups at their rims while the wheels turn."""
    return np.asarray(_brake_n(train.pad_n_per_pa, train.fade, cylinder_pa, speed_mps))


def resistance_n(nominal: Nominal, train: Train, speed_mps: Array) -> Array:
    """Return the running resistance; shape of the speed."""
    return np.asarray(_resistance_n(train.resistance, *nominal.resistance, speed_mps))


@formula("dddd->d")
def _brake_n(pad: float, fade: float, cylinder_pa: float, speed_mps: float, force: Array) -> None:
    force[0] = pad * (1.0 + fade * (min(speed_mps / FADE_MPS, 1.0) - 0.5)) * cylinder_pa


@formula("ddddd->d")
def _resistance_n(factor: float, c0: float, c1: float, c2: float, speed_mps: float, force: Array) -> None:
    force[0] = factor * (c0 + (c1 + c2 * speed_mps) * speed_mps)

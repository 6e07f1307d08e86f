# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Brake and resistance of a train as they were found: in words, as JSON, and as the proposal of its file."""

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

from ...core import Config

COAST_S, BRAKE_S = 20.0, 6.0
"""Length of a stretch over which a deceleration is taken."""


class Ratio(NamedTuple):
    """True over believed, with its standard error, of so many stretches; so many others were left out."""

    mean: float
    std: float
    stretches: int
    left_out: int


class Found(NamedTuple):
    """What a recording tells of a train; None where it tells nothing."""

    config: Config
    resistance: Ratio | None
    brake: Ratio | None

    @property
    def says_anything(self) -> bool:
        """Whether anything was found."""
        return self.resistance is not None or self.brake is not None

    @property
    def full_brake_mps2(self) -> float:
        """What the full brake gives by this, m/s^2, with the rotating mass."""
        return self.config.train.full_brake_mps2 * (1.0 if self.brake is None else self.brake.mean)

    @property
    def coefficients(self) -> tuple[float, float, float]:
        """c0, c1, c2 by this."""
        train, factor = self.config.train, 1.0 if self.resistance is None else self.resistance.mean
        return factor * train.resistance_c0, factor * train.resistance_c1, factor * train.resistance_c2

    def result(self) -> dict[str, Any]:
        """The findings by name."""
        ratios = {"resistance": self.resistance, "brake": self.brake}
        told = {f"{name}_ratio": None if one is None else one._asdict() for name, one in ratios.items()}
        return {**told, "deceleration_mps2": self.full_brake_mps2, "resistance_n_per_kn": list(self.coefficients)}

    def told(self) -> Iterator[str]:
        """The findings in words."""
        if self.resistance is None:
            yield f"resistance   not found: nowhere does it coast for {COAST_S:g} s: no brake, no traction"
        else:
            one, listed = self.resistance, ", ".join(f"{each:.4g}" for each in self.coefficients)
            text = f"{one.stretches} stretches of {COAST_S:g} s that coast; driven: {one.left_out}"
            yield f"resistance   {one.mean:.3f} ± {one.std:.3f} of the believed: {listed} N/kN; {text}"
        if self.brake is None:
            yield f"brake        not found: nowhere is its pressure steady for {BRAKE_S:g} s, and followed well"
        else:
            one = self.brake
            text = f"{one.stretches} stretches of {BRAKE_S:g} s at steady pressure; slid: {one.left_out}"
            found = f"{one.mean:.3f} ± {one.std:.3f} of the believed: {self.full_brake_mps2:.3f} m/s^2"
            yield f"brake        {found}; {text}"
            yield "             on a rail that was not dry throughout it is the adhesion that was found, not the brake"


def file_of(found: Found, source: str) -> str:
    """The proposal as a train's file."""
    train, (c0, c1, c2) = found.config.train, found.coefficients
    known = {"mass": found.config.mass_std, "rotating_mass": found.config.rotating_mass_std}
    known["brake"] = found.config.brake_std if found.brake is None else max(2.0 * found.brake.std, 0.05)
    known["resistance"] = (
        found.config.resistance_std if found.resistance is None else max(2.0 * found.resistance.std, 0.05)
    )
    return f"""\
# Proposed by `train --estimate {" ".join(source.split())}`.
name: {json.dumps(f"as found in {source}")}
mass_kg: {train.mass_kg:g}
length_m: {train.length_m:g}
wheel_radius_m: {train.wheel_radius_m:g}
rotating_mass_fraction: {train.rotating_mass_fraction:g}
brake:
  full_pressure_pa: {train.full_pressure_pa:g}
  build_up_s: {found.config.brake_build_up_s:g}
  deceleration_mps2: {found.full_brake_mps2:.4g}
resistance: {{c0: {c0:.4g}, c1: {c1:.4g}, c2: {c2:.4g}}}
known_to: {{{", ".join(f"{name}: {std:.3g}" for name, std in known.items())}}}
"""

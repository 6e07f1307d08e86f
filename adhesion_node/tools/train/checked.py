# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the file of a train comes to: its full brake, its stopping distances, and what of its numbers is unlikely."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core.physics import braking
from ...core.physics.adhesion import DRY
from ...core.physics.train import KMH
from ...wire.files.train import KNOWN_TO, TrainFile

SPEEDS_KMH = (400, 350, 300, 250, 200, 160, 120, 100, 80, 60, 40)


class Likely(NamedTuple):
    """Between what a number of a train usually lies."""

    what: str
    value: float
    low: float
    high: float
    unit: str
    hint: str

    @property
    def told(self) -> str:
        """The number, what is usual, and what may be wrong with it."""
        value = f"{self.value:.4g} {self.unit}".rstrip()
        return f"{self.what} = {value}, usual is {self.low:.4g} to {self.high:.4g}: {self.hint}"


def figures(file: TrainFile) -> dict[str, Any]:
    """What follows from the file, by name."""
    train = file.train
    return {
        "name": file.name,
        "mass_kg": train.mass_kg,
        "brake_per_mass_mps2": train.brake_force(train.full_pressure_pa) / train.mass_kg,
        "deceleration_mps2": train.full_brake_mps2,
        "adhesion_used": train.full_brake / (1.0 + train.rotating_mass_fraction),
        "build_up_s": file.build_up_s,
    }


def stopping(file: TrainFile) -> list[dict[str, float]]:
    """Ways and times to the standstill on a dry, level track, by speed; with the brake's build-up, half of it lost."""
    rows = []
    for kmh in (file.max_speed_kmh, *(one for one in SPEEDS_KMH if one < file.max_speed_kmh)):
        curve = braking.curve(file.train, kmh * KMH, DRY)
        lost_s = 0.5 * file.build_up_s
        way, time = float(curve.distance_m[-1]), float(curve.time_s[-1])
        rows.append(
            {"from_kmh": kmh, "distance_m": way + lost_s * kmh * KMH, "built_up_m": way, "time_s": time + lost_s}
        )
    return rows


def likely(file: TrainFile) -> Iterator[Likely]:
    """The numbers of a train, each beside what is usual."""
    train, found = file.train, figures(file)
    top = np.array(file.max_speed_kmh * KMH)
    yield Likely("full brake", found["deceleration_mps2"], 0.15, 1.6, "m/s^2", "is the mass that of the braked cars?")
    dry = float(DRY(top))
    hint = "at top speed a dry rail gives no more: is a part of it no friction brake?"
    yield Likely("adhesion that the full brake uses", found["adhesion_used"], 0.015, dry, "", hint)
    yield Likely("mass per length", 1e-3 * train.mass_kg / train.length_m, 0.7, 12.0, "t/m", "kg and m?")
    yield Likely("loaded over empty mass", file.loaded_kg / file.empty_kg, 1.0, 5.0, "", "kg both?")
    hint = "trains have 0.03 to 0.15, the paper's none; it takes part of the brake"
    yield Likely("rotating mass", train.rotating_mass_fraction, 0.02, 0.2, "of the mass", hint)
    yield Likely("full pressure", 1e-5 * train.full_pressure_pa, 1.5, 6.0, "bar", "of the cylinder, gauge, in Pa?")
    yield Likely("wheel radius", train.wheel_radius_m, 0.25, 0.70, "m", "is it the diameter?")
    yield Likely("build-up", file.build_up_s, 0.3, 40.0, "s", "from the demand to the full force")
    yield Likely("top speed", file.max_speed_kmh, 20.0, 400.0, "km/h", "km/h?")
    resistance = 1e3 * float(train.specific_resistance(top))
    yield Likely("resistance at top speed", resistance, 0.8, 40.0, "N/kN", "coefficients for km/h, per weight?")
    yield Likely("resistance near standstill", train.resistance_c0, 0.4, 6.0, "N/kN", "per weight, not per mass?")
    for name, std in KNOWN_TO.items():
        if std in file.values:
            yield Likely(f"known_to {name}", file.values[std], 0.001, 1.0, "of it", "per cent? 0.1 is 10 %")


def told(file: TrainFile, rows: Sequence[dict[str, float]]) -> Iterator[str]:
    """The file in words, with the ways to the standstill."""
    found, load = figures(file), ""
    if file.loaded_kg > file.empty_kg:
        load = f", {1e-3 * file.empty_kg:.4g} t empty to {1e-3 * file.loaded_kg:.4g} t loaded"
    yield f"{file.name}: {1e-3 * found['mass_kg']:.4g} t{load}, {file.train.length_m:.4g} m"
    yield f"B/M               {found['brake_per_mass_mps2']:.3f} m/s^2, of all brakes at full pressure"
    yield f"full brake        {found['deceleration_mps2']:.3f} m/s^2 with the rotating mass, without the resistance"
    yield f"adhesion used     {found['adhesion_used']:.4f}: where the rail gives less the wheels slide"
    yield "dry, level, to the standstill:   from km/h   way m   of it built up m   time s"
    for row in rows:
        yield f"{row['from_kmh']:42.0f}{row['distance_m']:8.0f}{row['built_up_m']:19.0f}{row['time_s']:9.1f}"

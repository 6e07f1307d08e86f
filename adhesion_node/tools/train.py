# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Looks at the file of a train before anything is computed for it, or proposes one from a recording.

`--check` prints what the full brake gives, the dry stopping distances, and what is unlikely; the exit code is 1 if
anything is. `--estimate` finds resistance and brake from how the recorded train coasts and brakes.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..bag import BagReader, overlooked, select_from
from ..command.checks import refuse
from ..command.options import (
    DONE,
    FAILED,
    help_texts,
    json_option,
    progress,
    remap_option,
    report,
    run_tool,
    setting_options,
)
from ..command.written import write_text
from ..core.physics import braking
from ..core.physics.adhesion import DRY
from ..core.physics.train import KMH
from ..run import offline
from ..wire.files.train import KNOWN_TO, TrainFile, read_train
from ..wire.settings.given import given
from ..wire.settings.nodes import SETTINGS
from ..wire.settings.setup import setup_of
from . import train_found

EXAMPLES = (
    "train --check my_train.yaml",
    "train --check metro",
    "train --estimate my_run --train my_train.yaml --output better_train.yaml",
)

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


def main(args: Sequence[str] | None = None) -> int:
    """Run `train --check FILE` or `train --estimate BAG`."""
    parser = argparse.ArgumentParser("train", parents=[json_option()], **help_texts(__doc__ or "", *EXAMPLES))
    one = parser.add_mutually_exclusive_group(required=True).add_argument
    one("--check", metavar="FILE", help="the train's file (doc/train.md), or high_speed, metro, freight")
    one("--estimate", metavar="BAG", help="a recording with coasting and with brakings on a dry rail")
    add = parser.add_argument
    add("--output", metavar="FILE", help="with --estimate: write the proposed train, a new file")
    remap_option(add)
    setting_options(parser.add_argument_group("what is believed of the recorded train and its track").add_argument)
    return run_tool(parser, _work, args)


def _work(options: argparse.Namespace) -> int:
    if options.check is None:
        return _estimate(options)
    of_estimate = ["output", "remap", "namespace", "seed", "set", "params", "train", "node"]
    refuse(options, of_estimate, "is for --estimate: --check takes the train's file alone, leave this out")
    file = read_train(options.check)
    rows, odd = stopping(file), [one.told for one in likely(file) if not one.low <= one.value <= one.high]
    result = {**figures(file), "stopping": rows, "unlikely": odd}
    report(options.json, result, "\n".join([*_told(file, rows), *(f"unlikely: {one}" for one in odd)]))
    return FAILED if odd else DONE


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


def _told(file: TrainFile, rows: Sequence[dict[str, float]]) -> Iterator[str]:
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


def _estimate(options: argparse.Namespace) -> int:
    refuse(options, ["seed"], "nothing is drawn by chance: leave it out")
    if options.output and Path(options.output).exists():
        raise ValueError(f"output = {options.output}: is there already: name a new file")
    setup = setup_of(given(options, "estimator", SETTINGS))
    with BagReader(options.estimate) as reader:
        for loss in reader.damage:
            print(f"train: {loss}", file=sys.stderr)
        selection = select_from(reader, options.remap, namespace=options.namespace)
        for hint in overlooked(reader.topics, selection, reader.namespace):
            print(f"train: {hint}", file=sys.stderr)
        recorded = progress(offline.messages(reader, selection, setup.line), "messages")
        found = train_found.find(setup.config, train_found.read(recorded, setup.line))
    text = [f"believed: {setup.train}", *found.told()]
    if options.output and found.says_anything:
        write_text(options.output, train_found.file_of(found, Path(options.estimate).name))
        text.append(f"{options.output} holds the proposal: train --check {options.output}")
    report(options.json, found.result(), "\n".join(text))
    return DONE if found.says_anything else FAILED

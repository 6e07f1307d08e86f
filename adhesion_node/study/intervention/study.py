# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study intervention`: where a train is braked by its safe curve, by the identified adhesion and by fixed values.

Replays the reference recordings offline and holds the braking curves of a few speeds against the limits of the ATP
monitor: distances before the target at which the emergency brake intervenes (EBI), the service brake (SBI), the driver
is warned, must brake (permitted) and is told to prepare (indication).
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...bag import BagReader, select
from ...command.checks import at_least
from ...command.options import progress
from ...core.atp import limits as etcs
from ...core.atp.config import SupervisionConfig
from ...core.atp.received import TrainState
from ...core.physics import braking
from ...core.physics.adhesion import WET
from ...core.physics.braking import BrakingCurve
from ...core.physics.train import CRH3, GRAVITY, KMH
from ...core.prediction import Prediction
from ...run import offline
from ...run.pipeline import Pipeline
from ...run.results.score import Truth
from ...wire.line import NOMINAL
from ..trial.estimators import EXACT
from ..trial.figures import Place, add_figure_options, figures_of
from ..xie.distances import BRAKINGS
from ..xie.published import WORST

SPEEDS_KMH = {"tunnel_entry": (280, 250, 200, 150), "tunnel_exit": (230, 200, 150, 100)}
"""Speeds at which the limits are looked at."""

EARLIER = {"sbi": "SBI", "warning": "W", "permitted": "P", "indication": "I"}
"""The limits that are met before the emergency intervention, as ETCS abbreviates them."""

SLIPPERY_MPS2 = 0.7
"""Default of A_NVMAXREDADH2 and 3, the largest deceleration on rail declared slippery (SUBSET-026-3, A.3.2)."""

PICTURE = "supervision"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study intervention`."""
    parser.add_argument("--bags", type=Path, default=Path("bags"), metavar="DIR", help="reference recordings")
    parser.add_argument("--kwet", type=float, default=0.8, help="K_wet_rst, a datum of each train; 0.8 is an example")
    parser.add_argument("--seed", type=int, default=1, help="seed of the particle filter")
    add_figure_options(parser, "the limits at 200 km/h of tunnel_entry")


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Return the table."""
    if not 0.0 < options.kwet <= 1.0:
        raise ValueError(f"kwet = {options.kwet}: give a factor above 0 up to 1")
    at_least(options, seed=0)
    figures = figures_of(options)
    table: list[dict[str, Any]] = []
    for scenario in BRAKINGS:
        said = predictions(options.bags / scenario, options.seed)
        table += rows(scenario, said, options.kwet)
        if scenario == "tunnel_entry" and figures is not None:
            _draw(said, figures.place(PICTURE))
    return table, "\n".join(lines(table))


def _draw(said: list[Prediction], place: Place) -> None:
    """Draw the limits of the safe curve at 200 km/h."""
    from .figure import draw

    last = _last(said, 200.0 * KMH)
    if last is None or last.safe is None:
        raise ValueError(f"figures = {place.path.parent}: there is no braking curve at 200 km/h to draw")
    fixed = braking.curve(CRH3, last.estimate.speed_mps, WORST)
    title = "Supervision limits by the safe curve"
    draw(SupervisionConfig(), last.safe, fixed, title, place)


def predictions(bag: Path, seed: int) -> list[Prediction]:
    """What the estimator says in an offline replay of a recording. Raises ValueError when it cannot be read."""
    with BagReader(bag) as reader:
        messages = offline.messages(reader, select(reader.topics), NOMINAL)
        return offline.replay(Pipeline(EXACT, seed), Truth(), progress(messages, "messages")).predictions


def rows(scenario: str, said: list[Prediction], kwet: float) -> Iterator[dict[str, Any]]:
    """A row for every speed and case; without a curve, or before the first estimate, the distances are None."""
    _, target_kmh = BRAKINGS[scenario]
    config = SupervisionConfig(target_speed_kmh=target_kmh)
    for speed_kmh in SPEEDS_KMH[scenario]:
        train = _train(_last(said, speed_kmh * KMH), speed_kmh * KMH)
        for case, (mu, curve) in _cases(said, speed_kmh * KMH, kwet).items():
            yield {
                "scenario": scenario,
                "speed_kmh": speed_kmh,
                "target_kmh": target_kmh,
                "case": case,
                "mu": mu,
                **_limits(config, curve, train),
            }


def _cases(
    said: list[Prediction], speed_mps: float, kwet: float
) -> dict[str, tuple[float | None, BrakingCurve | None]]:
    """Adhesion and braking curve of each case at a speed; adhesion of a fixed deceleration is that over g."""
    last = _last(said, speed_mps)
    fixed = {
        f"fixed {WORST}": WORST,
        f"K_wet {kwet:g}": kwet * CRH3.full_brake,
        f"slippery {SLIPPERY_MPS2:g}": SLIPPERY_MPS2 / GRAVITY,
    }
    return {
        "true wet law": (float(WET(np.asarray(speed_mps))), braking.curve(CRH3, speed_mps, WET)),
        "mu": (last and last.estimate.mu, last and last.nominal),
        "mu_lower": (last and last.estimate.mu_lower, last and last.safe),
        **{name: (mu, braking.curve(CRH3, speed_mps, mu)) for name, mu in fixed.items()},
    }


def _last(said: list[Prediction], speed_mps: float) -> Prediction | None:
    """Return the last prediction from a speed that covers the given one."""
    return next((one for one in reversed(said) if one.estimate.speed_mps >= speed_mps), None)


def _train(last: Prediction | None, speed_mps: float) -> TrainState:
    """The train at a speed, as sure as the last estimate before it."""
    sure = (0.0, 0.0) if last is None else (last.estimate.position_std_m, last.estimate.speed_std_mps)
    return TrainState(0, 0.0, speed_mps, *sure)


def _limits(config: SupervisionConfig, curve: BrakingCurve | None, train: TrainState) -> dict[str, float | None]:
    """Distances, m, of the estimated front end before the target at which each limit is met."""
    if curve is None:
        return {f"{name}_m": None for name in etcs.Limits._fields}
    ahead_m, fastest_mps = train.at_most(config, train.t_ns)
    found = etcs.distances(config, curve, np.array([fastest_mps]))
    margin_m = config.position_margin_m + ahead_m
    return {f"{name}_m": float(value[0]) + margin_m for name, value in found._asdict().items()}


def lines(table: list[dict[str, Any]]) -> Iterator[str]:
    """The table in words: the emergency intervention of each case, and how much earlier the other limits are met.

    These times do not depend on the adhesion, so they are the same in every case before a target speed.
    """
    cases = list(dict.fromkeys(row["case"] for row in table))
    for scenario, (_, target_kmh) in BRAKINGS.items():
        yield f"{scenario}: emergency brake intervention, m before {target_kmh:g} km/h; the others so much earlier"
        yield "  km/h" + "".join(f"{name:>14}" for name in cases) + "".join(f"{name:>6}" for name in EARLIER.values())
        for speed in SPEEDS_KMH[scenario]:
            here = [row for row in table if (row["scenario"], row["speed_kmh"]) == (scenario, speed)]
            ebi = "".join(f"{_meters(row['ebi_m']):>14}" for row in here)
            first = here[0]
            yield f"{speed:6d}{ebi}" + "".join(f"{first[f'{name}_m'] - first['ebi_m']:6.0f}" for name in EARLIER)


def _meters(value: float | None) -> str:
    return "no curve" if value is None else f"{value:.0f}"

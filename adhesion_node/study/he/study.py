# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study creep`: the experiments of He et al. 2017 on the creep curve, and what the paper leaves out.

Experiment 1: one dry rise of the creep, no forgetting; the peak as predicted from creeps up to 0.03. Experiments 2 and
3: dry, then wet, with the forgetting factor fixed at 0.99 and varying (13); `used_fraction` is the share of the new
surface's samples after which the estimated peak stays within 5 % of the truth to the end, the mean over the runs.
"""

import argparse
from dataclasses import replace
from typing import Any

import numpy as np

from ...command.checks import at_least
from ...command.running import add_running_options, run_all, running
from ...core.physics.train import Array
from ..trial.figures import add_figure_options, figures_of
from ..trial.text import Column, lines
from . import runs as he
from .beyond import BEYOND, Beyond, value_of
from .runs import RAMP

RUNS, SEED = 20, 1

SCAN_SWINGS, SCAN_RAMPS = (600, 800, 1000, 1200), (1000, 2000, 4000, 8000)
"""Samples of a rise in the sensitivity tables."""

SCAN_GAINS = (0.3, 1.0)
"""Other gains K_p of (13) for experiment 3 with one rise per surface."""

SWITCHES = {"2": he.FIXED_ETA, "3": he.VARYING_ETA}
"""The experiments on two surfaces."""

COLUMNS = (
    Column("experiment", 44, "<44", "experiment"),
    Column("true", 6, ".2f", "peak_true"),
    Column("estimated", 9, ".4f", "peak_estimated_mean"),
    Column("std", 6, ".4f", "peak_estimated_std"),
    Column("used", 6, ".3f", "used_fraction"),
    Column("first", 6, ".3f", "first_fraction"),
    Column("std before", 10, ".5f", "std_before_switch"),
)

WITHHELD = (
    Column("creep reached", 13, ".3f", "creep_reached"),
    Column("published", 11, ".3f", "published"),
    Column("wrong of these", 16, ".3f", "wrong_of_published"),
    Column("wrong if all were published", 28, ".3f", "wrong_of_all"),
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Give the study its options."""
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N", help="seeds per experiment")
    parser.add_argument("--seed", type=int, default=SEED, metavar="N", help="first seed")
    add_figure_options(parser, "Figs. 1-3 and 5-11")
    parser.add_argument("--sensitivity", action="store_true", help="also other numbers of samples and other gains")
    add_running_options(parser)


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Run the study; draw the figures where asked."""
    at_least(options, runs=2, seed=0)
    figures = figures_of(options)
    wanted = experiments(options.runs, options.seed)
    if options.sensitivity:
        wanted |= sensitivity(options.runs, options.seed)
    beyond = [Beyond(what, options.runs, options.seed) for what in BEYOND]
    found = list(run_all([*wanted.values(), *beyond], running(options)))
    thetas = {name: result["theta"] for name, result in zip(wanted, found[: len(wanted)], strict=True)}
    rows = [row_of(name, experiment, thetas[name]) for name, experiment in wanted.items()]
    *noises, covered, withheld, difference = map(value_of, found[len(wanted) :])
    rows[0] |= {"dfp_difference": difference, "coverage95": covered, "withholding": withheld}
    rows += [row for rows_of_std in noises for row in rows_of_std]
    if figures is not None:
        from .figures import draw

        draw(thetas, figures)
    return rows, text(rows)


def experiments(runs: int, seed: int) -> dict[str, he.Experiment]:
    """Experiments 1, 2 and 3 by name, 1 with the noise in mu, 2 and 3 with one single rise per surface."""
    one = he.Experiment(runs, seed)
    swinging = {name: one._replace(config=config, movement="swings") for name, config in SWITCHES.items()}
    return {"1": one, **swinging, "1, noise in mu": one._replace(in_mu=True), **single_rises(one, RAMP)}


def single_rises(one: he.Experiment, samples: int, suffix: str = "") -> dict[str, he.Experiment]:
    """Experiments 2 and 3 with one single rise per surface."""
    single = one._replace(movement="rise", samples=samples)
    return {f"{name}, single rise{suffix}": single._replace(config=config) for name, config in SWITCHES.items()}


def sensitivity(runs: int, seed: int) -> dict[str, he.Experiment]:
    """Experiments 2 and 3 with other numbers of samples, experiment 3 with other gains."""
    one = he.Experiment(runs, seed)
    wanted = {
        f"{name}, {samples} samples per rise": one._replace(config=config, movement="swings", samples=samples)
        for samples in SCAN_SWINGS
        for name, config in SWITCHES.items()
    }
    for samples in SCAN_RAMPS:
        wanted |= single_rises(one, samples, f" of {samples}")
    for gain in SCAN_GAINS:
        config = replace(he.VARYING_ETA, gain=gain)
        wanted[f"3, single rise, K_p {gain:g}"] = one._replace(config=config, movement="rise", samples=RAMP)
    return wanted


def row_of(name: str, experiment: he.Experiment, theta: Array) -> dict[str, Any]:
    """Row of an experiment: on one surface the estimate at a creep of 0.03, after a switch that at the end."""
    found, samples = he.peaks(theta), experiment.creeps.size
    if experiment.movement is None:
        share = he.ENOUGH / he.LAMBDA_M
        row = he.peak_row(name, he.DRY_PEAK, found[round(samples * share) - 1], share)
        return row | {"creep_used": he.ENOUGH, "samples": samples}
    before, after = found[samples // 2 : samples], found[samples:]
    used, first = he.fractions(after, he.WET_PEAK)
    return he.peak_row(name, he.WET_PEAK, after[-1], float(np.mean(used))) | {
        "used_fraction_5_to_95": np.quantile(used, [0.05, 0.95]).tolist(),
        "first_fraction": float(np.mean(first)),
        "std_before_switch": float(np.mean(np.std(before, axis=0))),
        "samples": samples,
    }


def text(rows: list[dict[str, Any]]) -> str:
    """Return the tables for people."""
    one = rows[0]
    shares = ", ".join(f"{name} {share:.3f}" for name, share in one["coverage95"].items())
    return "\n".join(
        [
            *lines(COLUMNS, rows),
            "",
            f"used: share of the new surface's samples after which the peak stays within {he.BAND:.0%} of the truth",
            "",
            f"share of 95 % intervals that hold the truth: {shares}",
            "",
            f"iteration against exact minimum: {one['dfp_difference']:.1e} of p1, p2 at most",
            "",
            *lines(WITHHELD, one["withholding"]),
        ]
    )

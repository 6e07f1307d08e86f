# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`study creep`: the experiments of He et al. 2017 on the creep curve, and what the paper leaves out.

Experiment 1: one dry rise of the creep, no forgetting; the peak as predicted from creeps up to 0.03. Experiments 2 and
3: dry, then wet, with the forgetting factor fixed at 0.99 and varying (13); `used_fraction` is the share of the new
surface's samples after which the estimated peak stays within 5 % of the truth to the end, the mean over the runs.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...command.options import DONE, report
from ...core.physics.train import Array
from ..trial.running import add_running_options, run_all, running
from .runs import (
    BAND,
    DRY_PEAK,
    ENOUGH,
    FIXED_ETA,
    LAMBDA_M,
    RAMP,
    VARYING_ETA,
    WET_PEAK,
    first_fraction,
    peaks,
    used_fraction,
)
from .tasks import BEYOND, Beyond, Experiment, value_of

RUNS, SEED = 20, 1

SCAN_SWINGS, SCAN_RAMPS = (600, 800, 1000, 1200), (1000, 2000, 4000, 8000)
"""Samples of a rise in the sensitivity tables."""

SCAN_GAINS = (0.3, 1.0)
"""Other gains K_p of (13) for experiment 3 with one rise per surface."""

SWITCHES = {"2": FIXED_ETA, "3": VARYING_ETA}
"""The experiments on two surfaces."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Give the study its options."""
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N", help=f"seeds per experiment (default {RUNS})")
    parser.add_argument("--seed", type=int, default=SEED, metavar="N", help=f"first seed (default {SEED})")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw Figs. 1-3 and 5-11 into DIR")
    parser.add_argument("--sensitivity", action="store_true", help="also other numbers of samples and other gains")
    add_running_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run the study; draw the figures where asked."""
    if options.runs < 2 or options.seed < 0:
        raise ValueError(f"runs = {options.runs}, seed = {options.seed}: give at least 2 runs and a seed of at least 0")
    wanted = experiments(options.runs, options.seed)
    if options.sensitivity:
        wanted |= sensitivity(options.runs, options.seed)
    beyond = [Beyond(what, options.runs, options.seed) for what in BEYOND]
    found = list(run_all([*wanted.values(), *beyond], running(options)))
    thetas = {name: result["theta"] for name, result in zip(wanted, found[: len(wanted)], strict=True)}
    rows = [row_of(name, experiment, thetas[name]) for name, experiment in wanted.items()]
    *noises, covered, withheld, difference = map(value_of, found[len(wanted) :])
    rows[0] |= {"dfp_difference": difference, "coverage95": covered, "withholding": withheld}
    noise = [row for rows_of_std in noises for row in rows_of_std]
    if options.figures:
        from . import figures as creep_figures
        from . import models as creep_models

        creep_figures.draw(thetas, options.figures)
        creep_models.draw(options.figures)
    report(options.json, rows + noise, text(rows, noise, covered, withheld, difference))
    return DONE


def experiments(runs: int, seed: int) -> dict[str, Experiment]:
    """Experiments 1, 2 and 3 by name, 1 with the noise in mu, 2 and 3 with one single rise per surface."""
    one = Experiment(runs, seed)
    swinging = {name: one._replace(config=config, movement="swings") for name, config in SWITCHES.items()}
    return {"1": one, **swinging, "1, noise in mu": one._replace(in_mu=True), **single_rises(one, RAMP)}


def single_rises(one: Experiment, samples: int, suffix: str = "") -> dict[str, Experiment]:
    """Experiments 2 and 3 with one single rise per surface."""
    single = one._replace(movement="rise", samples=samples)
    return {f"{name}, single rise{suffix}": single._replace(config=config) for name, config in SWITCHES.items()}


def sensitivity(runs: int, seed: int) -> dict[str, Experiment]:
    """Experiments 2 and 3 with other numbers of samples, experiment 3 with other gains."""
    one = Experiment(runs, seed)
    wanted = {
        f"{name}, {samples} samples per rise": one._replace(config=config, movement="swings", samples=samples)
        for samples in SCAN_SWINGS
        for name, config in SWITCHES.items()
    }
    for samples in SCAN_RAMPS:
        wanted |= single_rises(one, samples, f" of {samples}")
    for gain in SCAN_GAINS:
        config = replace(VARYING_ETA, gain=gain)
        wanted[f"3, single rise, K_p {gain:g}"] = one._replace(config=config, movement="rise", samples=RAMP)
    return wanted


def row_of(name: str, experiment: Experiment, theta: Array) -> dict[str, Any]:
    """Row of an experiment: on one surface the estimate at a creep of 0.03, after a switch that at the end."""
    found, samples = peaks(theta), experiment.samples_of_surface
    if experiment.movement is None:
        share = ENOUGH / LAMBDA_M
        row = _row(name, DRY_PEAK, found[round(samples * share) - 1], share)
        return row | {"creep_used": ENOUGH, "samples": samples}
    before, after = found[samples // 2 : samples], found[samples:]
    used = used_fraction(after, WET_PEAK)
    return _row(name, WET_PEAK, after[-1], float(np.mean(used))) | {
        "used_fraction_5_to_95": np.quantile(used, [0.05, 0.95]).tolist(),
        "first_fraction": float(np.mean(first_fraction(after, WET_PEAK))),
        "std_before_switch": float(np.mean(np.std(before, axis=0))),
        "samples": samples,
    }


def text(
    rows: list[dict[str, Any]],
    noise: list[dict[str, Any]],
    covered: dict[str, float],
    withheld: list[dict[str, float]],
    difference: float,
) -> str:
    """Return the tables for people."""
    lines = [f"{'experiment':<44} {'true':>6} {'estimated':>18} {'used':>6} {'first':>6} {'std before':>10}"]
    for row in rows + noise:
        spread = f"{row['peak_estimated_mean']:.4f} +- {row['peak_estimated_std']:.4f}"
        first = f"{row['first_fraction']:6.3f} {row['std_before_switch']:10.5f}" if "first_fraction" in row else ""
        lines.append(
            f"{row['experiment']:<44} {row['peak_true']:6.2f} {spread:>18} {row['used_fraction']:6.3f} {first}"
        )
    lines += ["", f"used: share of the new surface's samples after which the peak stays within {BAND:.0%} of the truth"]
    shares = ", ".join(f"{name} {share:.3f}" for name, share in covered.items())
    lines += ["", f"share of 95 % intervals that hold the truth: {shares}"]
    lines += ["", f"iteration against exact minimum: {difference:.1e} of p1, p2 at most", ""]
    lines += ["creep reached   published   wrong of these   wrong if all were published"]
    lines += [
        f"{row['creep_reached']:13.3f} {row['published']:11.3f} "
        f"{row['wrong_of_published']:16.3f} {row['wrong_of_all']:28.3f}"
        for row in withheld
    ]
    return "\n".join(lines)


def _row(name: str, truth: float, peaks: Array, used: float) -> dict[str, Any]:
    return {
        "experiment": int(name) if name.isdigit() else name,
        "peak_true": truth,
        "peak_estimated_mean": float(np.mean(peaks)),
        "peak_estimated_std": float(np.std(peaks)),
        "used_fraction": used,
    }

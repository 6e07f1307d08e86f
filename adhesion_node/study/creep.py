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

from ..cli import DONE, report
from ..core.train import Array
from . import creep_beyond
from .creep_runs import (
    BAND,
    DRY_PEAK,
    ENOUGH,
    FIXED_ETA,
    LAMBDA_M,
    RAMP,
    RISE,
    VARYING_ETA,
    WET_PEAK,
    Trace,
    first_fraction,
    one_surface,
    rise,
    swings,
    switched,
    used_fraction,
)

RUNS, SEED = 20, 1

SCAN_SWINGS, SCAN_RAMPS = (600, 800, 1000, 1200), (1000, 2000, 4000, 8000)
"""Samples of a rise in the sensitivity tables."""

SCAN_GAINS = (0.3, 1.0)
"""Other gains K_p of (13) for experiment 3 with one rise per surface."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Give the study its options."""
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N", help=f"seeds per experiment (default {RUNS})")
    parser.add_argument("--seed", type=int, default=SEED, metavar="N", help=f"first seed (default {SEED})")
    parser.add_argument("--figures", metavar="DIR", help="draw the counterparts of the paper's Figs. 5-11 into DIR")
    parser.add_argument("--sensitivity", action="store_true", help="also other numbers of samples and other gains")


def run(options: argparse.Namespace) -> int:
    """Run the study; draw the figures where asked."""
    if options.runs < 2 or options.seed < 0:
        raise ValueError(f"runs = {options.runs}, seed = {options.seed}: give at least 2 runs and a seed of at least 0")
    runs, seed = options.runs, options.seed
    traces = main_traces(runs, seed)
    rows = [row_of_one("1", traces["1"])]
    rows += [row_of_switch(name, traces[name], swings().size) for name in ("2", "3")]
    rows += [row_of_one("1, noise in mu", one_surface(runs, seed, in_mu=True)), *ramp_rows(runs, seed, RAMP)]
    if options.sensitivity:
        rows += sensitivity(runs, seed)
    noise = creep_beyond.creep_noise(runs, seed)
    covered, withheld = creep_beyond.coverage(seed), creep_beyond.withholding(seed)
    difference = creep_beyond.dfp_difference(runs, seed)
    rows[0] |= {"dfp_difference": difference, "coverage95": covered, "withholding": withheld}
    if options.figures:
        from .creep_figures import draw

        draw(traces, Path(options.figures))
    report(options.json, rows + noise, text(rows, noise, covered, withheld, difference))
    return DONE


def main_traces(runs: int, seed: int) -> dict[str, Trace]:
    """Experiments 1, 2 and 3 by name."""
    return {
        "1": one_surface(runs, seed),
        "2": switched(FIXED_ETA, swings(), runs, seed),
        "3": switched(VARYING_ETA, swings(), runs, seed),
    }


def row_of_one(name: str, trace: Trace) -> dict[str, Any]:
    """Row of experiment 1: the estimate at a creep of 0.03, which used 30 % of the rise."""
    predicted = trace.peaks[round(RISE * ENOUGH / LAMBDA_M) - 1]
    return _row(name, DRY_PEAK, predicted, ENOUGH / LAMBDA_M) | {"creep_used": ENOUGH, "samples": RISE}


def row_of_switch(name: str, trace: Trace, samples: int) -> dict[str, Any]:
    """Row of experiment 2 or 3: the estimate at the end of the `samples` on the new surface."""
    before, after = trace.peaks[samples // 2 : samples], trace.peaks[samples:]
    used = used_fraction(after, WET_PEAK)
    return _row(name, WET_PEAK, after[-1], float(np.mean(used))) | {
        "used_fraction_5_to_95": np.quantile(used, [0.05, 0.95]).tolist(),
        "first_fraction": float(np.mean(first_fraction(after, WET_PEAK))),
        "std_before_switch": float(np.mean(np.std(before, axis=0))),
        "samples": samples,
    }


def ramp_rows(runs: int, seed: int, samples: int) -> list[dict[str, Any]]:
    """Experiments 2 and 3 with one single rise per surface."""
    creeps = rise(samples)
    return [
        row_of_switch(f"{name}, single rise", switched(config, creeps, runs, seed), samples)
        for name, config in (("2", FIXED_ETA), ("3", VARYING_ETA))
    ]


def sensitivity(runs: int, seed: int) -> list[dict[str, Any]]:
    """Experiments 2 and 3 with other numbers of samples, experiment 3 with other gains."""
    rows = [
        row_of_switch(f"{name}, {samples} samples per rise", switched(config, swings(samples), runs, seed), creeps.size)
        for samples in SCAN_SWINGS
        for creeps in (swings(samples),)
        for name, config in (("2", FIXED_ETA), ("3", VARYING_ETA))
    ]
    for samples in SCAN_RAMPS:
        rows += [row | {"experiment": f"{row['experiment']} of {samples}"} for row in ramp_rows(runs, seed, samples)]
    for gain in SCAN_GAINS:
        trace = switched(replace(VARYING_ETA, gain=gain), rise(RAMP), runs, seed)
        rows.append(row_of_switch(f"3, single rise, K_p {gain:g}", trace, RAMP))
    return rows


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

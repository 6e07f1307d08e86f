# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""How the estimation stands, for /diagnostics: findings in words, and the numbers behind them."""

from __future__ import annotations

from adhesion_node.core import Estimate, Outcome, Regime
from adhesion_node.core.atp.supervision import Severity
from adhesion_node.run.pipeline import Pipeline

from .ros.diagnostics import Finding

UNMEASURED = "no brake pressure: a full brake is assumed"


def findings(pipeline: Pipeline) -> list[Finding]:
    """Return what is wrong, and in which regime the train is."""
    if pipeline.state.stuck:
        return [Finding(Severity.ERROR, f"position: {Outcome.STUCK.value}; mu is withheld, the curve on the low law")]
    if pipeline.last is None:
        return [Finding(Severity.WARN, "no estimate yet")]
    found = [Finding(Severity.OK, pipeline.last.regime.value)]
    newest = pipeline.state.newest
    if newest is not None and newest.brake_pressure_pa is None:
        found.append(Finding(Severity.WARN, UNMEASURED))
    return found


def values(pipeline: Pipeline) -> dict[str, str]:
    """Return the numbers by name."""
    drops = {f"dropped.{reason}": str(count) for reason, count in pipeline.dropped.items()}
    counts = {
        "measurements": str(pipeline.measurements),
        "accepted": str(pipeline.accepted),
        "resets": str(pipeline.resets),
        "windows": str(pipeline.windows),
    }
    told = {"confidence": f"{pipeline.config.confidence:g}", "digest": pipeline.digest}
    return {**_estimate_values(pipeline.last), **counts, **drops, **told}


def _estimate_values(last: Estimate | None) -> dict[str, str]:
    if last is None:
        return {"regime": Regime.COASTING.name}
    return {
        "regime": last.regime.name,
        "mu": f"{last.mu:.5f}",
        "mu_std": f"{last.mu_std:.5f}",
        "mu_lower": f"{last.mu_lower:.5f}",
        "window": str(last.window),
        "iterations": str(last.iterations),
        "converged": str(last.converged).lower(),
        "log_likelihood": f"{last.log_likelihood:.3f}",
        "ess": f"{last.ess:.1f}",
    }

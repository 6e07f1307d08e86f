"""The estimator's entry in /diagnostics: what an operator must know, in words, and the numbers behind it."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from adhesion_node.core import Estimate, Outcome, Regime
from adhesion_node.pipeline import Pipeline

from . import convert

UNMEASURED = "no brake pressure: a full brake is assumed"


def diagnostics_message(t_ns: int, pipeline: Pipeline, refusal: str = "") -> DiagnosticArray:
    """Build the status at `t_ns`; `refusal` says why a message has just been refused."""
    level, message = _judgement(pipeline, refusal)
    status = DiagnosticStatus(
        level=level,
        name="estimator/adhesion",
        message=message,
        values=[KeyValue(key=key, value=value) for key, value in _values(pipeline).items()],
    )
    return DiagnosticArray(header=convert.header(t_ns), status=[status])


def _judgement(pipeline: Pipeline, refusal: str) -> tuple[bytes, str]:
    if refusal:
        return DiagnosticStatus.WARN, f"message refused: {refusal}"
    if pipeline.last is None:
        return DiagnosticStatus.WARN, "no estimate yet"
    newest = pipeline.state.newest
    if newest is not None and newest.brake_pressure_pa is None:
        return DiagnosticStatus.WARN, f"{UNMEASURED}; {pipeline.last.regime.value}"
    return DiagnosticStatus.OK, pipeline.last.regime.value


def _values(pipeline: Pipeline) -> dict[str, str]:
    drops = {f"dropped.{reason}": str(count) for reason, count in pipeline.dropped.items()}
    counts = {
        "measurements": str(pipeline.measurements),
        "accepted": str(pipeline.accepted),
        "resets": str(pipeline.state.counts[Outcome.RESET]),
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

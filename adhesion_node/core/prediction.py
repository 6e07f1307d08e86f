"""What a consumer brakes by: an estimate with its two braking curves."""

from __future__ import annotations

from typing import NamedTuple

from . import braking
from .braking import BrakingCurve
from .config import Config
from .estimate import Estimate


class Prediction(NamedTuple):
    """An estimate and the emergency braking from there to a standstill."""

    estimate: Estimate
    safe: BrakingCurve | None
    """Built on mu_lower; None where the train would not slow down with so little adhesion."""
    nominal: BrakingCurve | None
    """Built on mu."""


def predict(config: Config, estimate: Estimate) -> Prediction:
    """Braking curves from the estimate's speed on the least favourable resistance of the track ahead.

    Adhesion is held at its present value: on the published laws it only rises while the train slows down.
    """
    resistance = config.track.least_resistance(estimate.position_m)
    return Prediction(
        estimate,
        _curve(config, estimate.speed_mps, estimate.mu_lower, resistance),
        _curve(config, estimate.speed_mps, estimate.mu, resistance),
    )


def _curve(config: Config, speed_mps: float, mu: float, resistance: float) -> BrakingCurve | None:
    try:
        return braking.curve(config.train, speed_mps, max(mu, 0.0), grade=resistance)
    except ValueError:  # more downgrade than brake: no curve is the honest answer, and consumers brake on silence
        return None

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A physical check of positions: a deceleration that no brake and rail give is that of a wheel, not of the train."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..physics.train import GRAVITY, Array
from . import kinds
from .layout import SPEED, Bank
from .motion import slow_variance, white_variance

if TYPE_CHECKING:
    from ..config import Config

S = 1_000_000_000

SPAN_NS, LEAST = 3 * S, 8
"""Time and number of the positions that are looked at together."""

BRAKE_ERROR, RESISTANCE_ERROR, SIGMA = 1.15, 1.2, 3.0
"""Factors on brake and resistance, and standard deviations, beyond which a deceleration is impossible."""

GAIN_MPS2, BRAKED_NS = 0.1, 3 * S
"""A train that has been braked so long does not gain speed by more than this, and the grade's part."""


class Course(NamedTuple):
    """Positions of the last seconds, stamps in ns and m."""

    recent: tuple[tuple[int, float], ...] = ()
    braked_ns: int | None = None
    """Since when the brake is applied."""

    def after(self, t_ns: int, position_m: float, braked: bool) -> Course:
        """With the next position."""
        recent = (*(each for each in self.recent if t_ns - SPAN_NS <= each[0] < t_ns), (t_ns, position_m))
        since = self.braked_ns if braked and self.braked_ns is not None else t_ns
        return Course(recent, since if braked else None)

    def is_impossible(self, config: Config, bank: Bank, declared_m: float) -> bool:
        """Whether no train moves so, by a parabola through the positions, in spite of their errors."""
        stamps, places = np.array([each[0] for each in self.recent]), np.array([each[1] for each in self.recent])
        if self.braked_ns is None or stamps.size < LEAST:
            return False
        time = (stamps - stamps[-1]) / S
        span = float(-time[0])
        if span < 0.8 * SPAN_NS / S:
            return False
        slowing = -2.0 * float(np.polyfit(time, places, 2)[0])
        error = SIGMA * _error(bank, declared_m, span, stamps.size)
        speed = max(float(bank.weight @ bank.mean[:, SPEED]), 0.0)
        resistance = GRAVITY * float(config.train.specific_resistance(np.array(speed)))
        most = GRAVITY * config.train.specific_brake(config.train.full_pressure_pa)
        grade = GRAVITY * 2.0 * config.grade_error
        if slowing > BRAKE_ERROR * most + RESISTANCE_ERROR * resistance + grade + error:
            return True
        long = stamps[0] - self.braked_ns >= BRAKED_NS
        return bool(long and slowing < -GAIN_MPS2 - grade - error)


def _error(bank: Bank, declared_m: float, span_s: float, count: int) -> float:
    """Standard deviation of the parabola's deceleration by white errors and by those that wander, m/s^2."""
    white = 720.0 * white_variance(bank, declared_m) / (count * span_s**4)
    wander: Array = 17.0 * 2.0 * slow_variance(bank, declared_m) / kinds.LASTS[bank.noise] / span_s**3
    return float(np.sqrt(bank.weight @ (white + wander)))

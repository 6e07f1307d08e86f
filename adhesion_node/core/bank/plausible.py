# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A physical check of positions: a deceleration that no brake and rail give is that of a wheel, not of the train."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..physics.train import GRAVITY, Array
from . import kinds
from .layout import SPEED, Bank
from .motion import white_variance

if TYPE_CHECKING:
    from ..config import Config

S = 1_000_000_000

SPAN_NS, LEAST = 3 * S, 8
"""Time of the positions that are kept, and how many must be looked at together."""

LOOKS = ((3.0, 4.0), (1.5, 5.0))
"""Times, s, over which they are looked at, and the standard deviations beyond which a deceleration is impossible."""

RECEIVER = 1
"""Index into `NOISES` of what satellites may always do."""

BRAKE_ERROR, RESISTANCE_ERROR = 1.15, 1.2
"""Factors on the full brake and the running resistance that are still possible."""

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
        speed = max(float(bank.weight @ bank.mean[:, SPEED]), 0.0)
        brake = config.train.specific_brake(config.train.full_pressure_pa)
        resistance, grade = float(config.train.specific_resistance(np.array(speed))), 2.0 * config.grade_error
        most = GRAVITY * (BRAKE_ERROR * brake + RESISTANCE_ERROR * resistance + grade)
        time = (stamps - stamps[-1]) / S
        for span_s, sigma in LOOKS:
            seen = time >= -span_s
            if np.count_nonzero(seen) < LEAST or time[seen][0] > -0.8 * span_s:
                continue
            slowing = -2.0 * _curvature(time[seen], places[seen] - places[-1])
            error = sigma * _error(bank, declared_m, span_s, int(np.count_nonzero(seen)))
            long = stamps[seen][0] - self.braked_ns >= BRAKED_NS
            if slowing > most + error or (long and slowing < -GAIN_MPS2 - GRAVITY * grade - error):
                return True
        return False


def _curvature(time: Array, places: Array) -> float:
    """Coefficient of t^2 of the parabola through places, by the polynomial that is orthogonal to 1 and t."""
    centred = time - time.mean()
    square = np.square(centred)
    bend = square - (square @ centred) / square.sum() * centred - square.mean()
    return float(bend @ places / (bend @ bend))


def _error(bank: Bank, declared_m: float, span_s: float, count: int) -> float:
    """Standard deviation of the parabola's deceleration, m/s^2, by white errors and by the worst that wander."""
    white = 720.0 * float(bank.weight @ white_variance(bank, declared_m)) / (count * span_s**4)
    slow = np.maximum(kinds.SLOW[:, 0] * declared_m, kinds.SLOW[:, 1]) ** 2 / kinds.LASTS
    wander = 17.0 * 2.0 * float(max(slow[RECEIVER], slow[bank.noise].max())) / span_s**3
    return float(np.sqrt(white + wander))

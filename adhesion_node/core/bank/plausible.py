# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A physical check of positions: a deceleration that no brake and rail give is that of a wheel, not of the train."""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..physics.train import GRAVITY
from . import kinds
from .kernels import parabola
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
        first, end = bisect_left(self.recent, (t_ns - SPAN_NS,)), bisect_left(self.recent, (t_ns,))
        recent = (*self.recent[first:end], (t_ns, position_m))
        since = self.braked_ns if braked and self.braked_ns is not None else t_ns
        return Course(recent, since if braked else None)

    def is_impossible(self, config: Config, bank: Bank, declared_m: float) -> bool:
        """Whether no train moves so, by a parabola through the positions, in spite of their errors."""
        if self.braked_ns is None or len(self.recent) < LEAST:
            return False
        speed = max(bank.mean_of(SPEED), 0.0)
        brake = config.train.specific_brake(config.train.full_pressure_pa)
        c0, c1, c2 = config.train.resistance_si
        grade = 2.0 * config.grade_error
        most = GRAVITY * (BRAKE_ERROR * brake + RESISTANCE_ERROR * (c0 + speed * (c1 + c2 * speed)) + grade)
        newest_ns, newest_m = self.recent[-1]
        time = np.array([(t_ns - newest_ns) / S for t_ns, _ in self.recent])
        places = np.array([place_m - newest_m for _, place_m in self.recent])
        for span_s, sigma in LOOKS:
            first = int(time.searchsorted(-span_s))
            count = time.size - first
            if count < LEAST or time[first] > -0.8 * span_s:
                continue
            slowing = -2.0 * parabola.curvature(time[first:], places[first:])
            error = sigma * _error(bank, declared_m, span_s, count)
            long = self.recent[first][0] - self.braked_ns >= BRAKED_NS
            if slowing > most + error or (long and slowing < -GAIN_MPS2 - GRAVITY * grade - error):
                return True
        return False


def _error(bank: Bank, declared_m: float, span_s: float, count: int) -> float:
    """Standard deviation of the parabola's deceleration, m/s^2, by white errors and by the worst that wander."""
    white = 720.0 * float(bank.weight @ white_variance(bank, declared_m)) / (count * span_s**4)
    slow = [max(noise.slow * declared_m, noise.least_slow_m) ** 2 / noise.lasts_s for noise in kinds.NOISES]
    wander = 17.0 * 2.0 * max(slow[noise] for noise in {RECEIVER, *bank.noise.tolist()}) / span_s**3
    return math.sqrt(white + wander)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A speed that leaps as no train does: from then on its scale may be another one, as a radar's over snow."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...physics.train import GRAVITY, Array
from ..layout import SCALE, SPEED, Bank

if TYPE_CHECKING:
    from ...config import Config

S = 1_000_000_000

FAR, GAP_S, HEARD_S = 4.0, 1.0, 3.0
"""Standard deviations by which a speed lies off that has leapt, by every hypothesis and beside all that the brake could
do since the one before: with 3 outliers move the scale of a speed that nothing else holds. It must have been heard for
so long without such a gap: before, the train may be what leaps."""

BACK_S, BACK = 5.0, 0.6
"""For so long it may leap back, by more than this share of what it had leapt by, whatever the brake could do."""


class Leaping(NamedTuple):
    """By how much a speed leapt last, and when."""

    by_mps: float = 0.0
    at_ns: int = 0
    since_ns: int | None = None
    """Since when it has been heard without a gap."""
    scale: tuple[float, float] = (0.0, 0.0)
    """Its scale error before it leapt, mean and standard deviation."""

    def after(
        self, config: Config, bank: Bank, t_ns: int, elapsed_s: float, innovation: Array, std: Array
    ) -> tuple[Leaping, Bank]:
        """With the next speed, so long after the one before; what it is off by, and may be, shape (H,), each m/s.

        If it has leapt, its scale may be another one by as much; if it has leapt back, the one before.
        """
        if self.since_ns is None or elapsed_s >= GAP_S:
            return self._replace(since_ns=t_ns), bank
        speed = bank.mean_of(SPEED)
        if t_ns - self.since_ns < HEARD_S * S or speed < config.slowest_mps:
            return self, bank
        by_mps, braked_mps = float(bank.weight @ innovation), GRAVITY * config.train.full_brake * elapsed_s
        if t_ns - self.at_ns < BACK_S * S and by_mps * self.by_mps < -BACK * self.by_mps**2:
            return self._replace(by_mps=0.0), bank.with_fresh(SCALE, *self.scale)
        if not (np.abs(innovation) > FAR * std + braked_mps).all():
            return self, bank
        scale = bank.mean_of(SCALE), max(bank.std_of(SCALE), config.speed_scale_std)
        covariance = bank.covariance.copy()
        covariance[:, SCALE, SCALE] += (by_mps / speed) ** 2
        return Leaping(by_mps, t_ns, self.since_ns, scale), bank._replace(covariance=covariance)

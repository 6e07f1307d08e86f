# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Refuses what is well formed and must not be used all the same: too many messages, a stuck sensor, a wrong unit.

Stamps and values alone decide, never a clock: a live node and an offline replay refuse alike.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..core import Config, Estimate, Regime
from ..core.intake.inbox import PositionSample, Sample, SpeedSample
from ..core.prediction import Prediction, predict
from ..wire.codecs import NS, Reason, Rejected

SHORTEST_NS = 5_000_000
"""Least time between two messages of a sensor: 200 a second are more than an estimate needs."""

STUCK_STEPS, LEAST_STUCK_M, MOST_STUCK_M = 2.0, 2.0, 10.0
"""A position that repeats itself to the bit comes in steps, and steps of d alone have the variance d^2/12. A train that
must have gone so many of the greatest steps that the variance allows, within these bounds, has a stuck sensor."""

STRONGEST_MPS2 = 3.0
"""No train brakes harder."""

KMH_PER_MPS, KMH_BAND, KMH_FROM_MPS = 3.6, 0.15, 5.0
"""A speed within this share of 3.6 times the estimate is one in km/h; told from this speed on."""


class Held(NamedTuple):
    """A position, since when it has been the same, and the last estimate before it."""

    position_m: float
    since_ns: int
    before: Estimate | None


class Guard:
    """Judges samples one by one before they are used. Mutable, as the pipeline that it belongs to."""

    def __init__(self) -> None:
        self.stuck = False
        self._newest_ns: dict[type[Sample], int] = {}
        self._held: Held | None = None

    def refusal(self, sample: Sample, last: Estimate | None) -> Rejected | None:
        """Say why a sample must not be used; None when it may. `last` is the newest estimate."""
        if isinstance(sample, PositionSample) and 0.0 < sample.variance_m2 < math.inf:  # others are no measurements
            self._watch(sample, last)
            if self.stuck:
                return Rejected(Reason.STUCK, f"position x = {sample.position_m:.12g}")
        if isinstance(sample, SpeedSample) and last is not None and _is_kmh(sample.speed_mps, last.speed_mps):
            return Rejected(Reason.SPEED_IN_KMH, f"speed x = {sample.speed_mps:g} at {last.speed_mps:.3g} m/s")
        newest_ns = self._newest_ns.get(type(sample))
        if newest_ns is not None and 0 < sample.t_ns - newest_ns < SHORTEST_NS:
            return Rejected(Reason.TOO_OFTEN, f"{(sample.t_ns - newest_ns) / NS:g} s after the one before")
        self._newest_ns[type(sample)] = sample.t_ns
        return None

    def blind(self, config: Config, t_ns: int) -> Prediction | None:
        """Return what a consumer may count on while the sensor is stuck: the safe curve on the low-adhesion law.

        It begins where the train is if it has not slowed down since. None when nothing was known before.
        """
        before = self._held.before if self._held else None
        if before is None:
            return None
        unseen_s = (t_ns - before.t_ns) / NS
        low = float(config.low_law(np.asarray(before.speed_mps)))
        unseen = before._replace(
            t_ns=t_ns,
            mu=low,
            mu_std=config.unknown_std,
            mu_lower=low,
            regime=Regime.COASTING,
            position_m=before.position_m + before.speed_mps * unseen_s,
            position_std_m=before.position_std_m + STRONGEST_MPS2 * unseen_s**2 / 2,
            speed_std_mps=before.speed_std_mps + STRONGEST_MPS2 * unseen_s,
            window=0,
            iterations=0,
        )
        return predict(config, unseen)._replace(nominal=None, withheld=True)

    def _watch(self, sample: PositionSample, last: Estimate | None) -> None:
        held = self._held
        if held is None or sample.position_m != held.position_m or sample.t_ns < held.since_ns:
            self._held = Held(sample.position_m, sample.t_ns, last)
            self.stuck = False
        elif held.before is not None:
            known_s = abs(held.since_ns - held.before.t_ns) / NS
            slowest = max(held.before.speed_mps - 3.0 * held.before.speed_std_mps - STRONGEST_MPS2 * known_s, 0.0)
            self.stuck = least_way(slowest, (sample.t_ns - held.since_ns) / NS) >= stuck_way(sample.variance_m2)


def stuck_way(variance_m2: float) -> float:
    """Way, m, over which no working sensor of this variance repeats itself.

    >>> [round(stuck_way(std_m**2), 2) for std_m in (0.1, 0.5, 5.0)]
    [2.0, 3.46, 10.0]
    """
    return min(max(STUCK_STEPS * math.sqrt(12.0 * variance_m2), LEAST_STUCK_M), MOST_STUCK_M)


def least_way(speed_mps: float, elapsed_s: float) -> float:
    """Way, m, that a train has gone at least after it was as fast as this.

    >>> least_way(30.0, 2.0), least_way(30.0, 100.0), least_way(0.0, 5.0)
    (54.0, 150.0, 0.0)
    """
    braking_s = min(elapsed_s, speed_mps / STRONGEST_MPS2)
    return speed_mps * braking_s - STRONGEST_MPS2 * braking_s**2 / 2


def _is_kmh(speed_mps: float, known_mps: float) -> bool:
    return known_mps >= KMH_FROM_MPS and abs(speed_mps / (KMH_PER_MPS * known_mps) - 1.0) <= KMH_BAND

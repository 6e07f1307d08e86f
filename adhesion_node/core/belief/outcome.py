# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""What became of a measurement."""

from __future__ import annotations

from enum import Enum


class Outcome(Enum):
    """What the estimator did with a measurement; the value says it in words."""

    ACCEPTED = "accepted"
    LATE = "older than the newest one by more than max_lag_s: dropped"
    DUPLICATE = "a second measurement with the same stamp: dropped"
    INVALID = "not finite, no positive variance or physically impossible: dropped"
    OUTLIER = "further from the prediction than gate_sigma: dropped"
    RESET = "stamp or position jumped: the estimation starts anew"

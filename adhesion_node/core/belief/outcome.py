# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""What became of a measurement, and which part of the motion can be seen."""

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


class Regime(Enum):
    """What limits the motion at present; the value says what that tells of the adhesion."""

    COASTING = "nothing can be learnt of the adhesion: no brake, or too little seen yet"
    BRAKE_LIMITED = "the brake limits: the adhesion is at least what it uses"
    ADHESION_LIMITED = "the adhesion limits: it is identified"

# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The estimator as pure functions of arrays: no ROS, no files, no clock, no logging."""

from .belief.outcome import Outcome
from .belief.regime import Regime
from .config import Config
from .estimate import Estimate
from .estimator import State, finish, init, step
from .intake.samples import Measurement

__all__ = ["Config", "Estimate", "Measurement", "Outcome", "Regime", "State", "finish", "init", "step"]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The estimator as pure functions of arrays: no ROS, no files, no clock, no logging.

The names here are public: they stay when modules move.
"""

from .belief.regime import Regime
from .config import Config
from .estimate import Estimate
from .estimator import advance, finish, init, step
from .intake.outcome import Event, Outcome
from .intake.samples import (
    DemandSample,
    ForceSample,
    ImuSample,
    Measurement,
    PositionSample,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from .physics import braking
from .prediction import Prediction, predict
from .state import State

__all__ = [
    "Config",
    "DemandSample",
    "Estimate",
    "Event",
    "ForceSample",
    "ImuSample",
    "Measurement",
    "Outcome",
    "PositionSample",
    "Prediction",
    "PressureSample",
    "Regime",
    "Sample",
    "SpeedSample",
    "State",
    "WheelSample",
    "advance",
    "braking",
    "finish",
    "init",
    "predict",
    "step",
]

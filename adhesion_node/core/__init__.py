# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The estimator as pure functions of arrays: no ROS, no files, no clock, no logging.

The names here are public: they stay when modules move. Those of the estimator itself are imported when they are first
asked for, so that what needs a sample or a curve alone starts without scipy and numba.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .belief.regime import Regime
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

if TYPE_CHECKING:
    from .config import Config
    from .estimate import Estimate
    from .estimator import advance, finish, init, step
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

_LATER = {
    **{"Config": "config", "Estimate": "estimate", "State": "state"},
    **dict.fromkeys(("Prediction", "predict"), "prediction"),
    **dict.fromkeys(("advance", "finish", "init", "step"), "estimator"),
}


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f".{_LATER[name]}", __name__), name)
    return value

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Onboard identification of the wheel-rail adhesion coefficient for ROS 2.

The names here are public: they stay when modules move, and need no ROS. They are loaded when they are first asked for,
so that a program of this package minds signals before anything heavy is there.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .core import Config, Estimate, Measurement, Prediction, Regime, State, finish, init, predict, step
    from .core.physics.track import Curve, Grade, Track, Tunnel
    from .core.physics.train import Train
    from .run.frames import estimate
    from .run.pipeline import Pipeline

_FROM = {
    ".core": (
        *("Config", "Estimate", "Measurement", "Prediction", "Regime", "State"),
        *("finish", "init", "predict", "step"),
    ),
    ".core.physics.track": ("Curve", "Grade", "Track", "Tunnel"),
    ".core.physics.train": ("Train",),
    ".run.frames": ("estimate",),
    ".run.pipeline": ("Pipeline",),
}

_MODULE_OF = {name: module for module, names in _FROM.items() for name in names}

__all__ = [
    "Config",
    "Curve",
    "Estimate",
    "Grade",
    "Measurement",
    "Pipeline",
    "Prediction",
    "Regime",
    "State",
    "Track",
    "Train",
    "Tunnel",
    "estimate",
    "finish",
    "init",
    "predict",
    "step",
]


def __getattr__(name: str) -> Any:
    """Load a public name where it is asked for."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_OF[name], __name__), name)


def __dir__() -> list[str]:
    """List the public names."""
    return __all__

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Settings of the creep identification, and what becomes of peaks."""

from dataclasses import dataclass
from enum import Enum

from ..physics.train import Array
from ..setting import check_settings, setting
from .curve import parameters
from .vehicle import LOCOMOTIVE, Vehicle

VARYING, FIXED = "varying", "fixed"
EXACT, DFP = "exact", "dfp"


class Peak(Enum):
    """Whether the data tell the peak; the value says it in words."""

    KNOWN = "the data tell the peak"
    FEW = "withheld: fewer than min_samples are remembered"
    NO_PEAK = "withheld: the curve that fits best has no peak (p1 or p2 at its limit 0)"
    UNSURE = "withheld: the standard deviation of mu_max is above max_relative_std of it"
    CHANGING = "withheld: the newest samples lie on one side of the curve, the surface is changing"


@dataclass(frozen=True, slots=True)
class CreepConfig:
    """Settings of the identification; the defaults are the paper's. Raises ValueError naming setting and range."""

    vehicle: Vehicle = LOCOMOTIVE
    slope: float = setting(
        20.0, "Initial slope of the curve, mu_0; known, about the same on every surface", "", 0.1, 1e3
    )
    start_mu_max: float = setting(0.35, "Peak of the curve from which the identification starts", "", 1e-3, 2.0)
    start_lambda_m: float = setting(0.1, "Creep of that peak", "", 1e-3, 1.0)
    forgetting: str = setting(VARYING, "Forgetting factor: varying by (13), or fixed", choices=(VARYING, FIXED))
    eta: float = setting(0.99, "Forgetting factor where it is fixed", low=0.5, high=1.0)
    eta_max: float = setting(1.0, "Largest varying forgetting factor", low=0.5, high=1.0)
    eta_min: float = setting(0.971, "Smallest varying forgetting factor", low=0.5, high=1.0)
    gain: float = setting(0.1, "Gain of the varying forgetting factor, K_p", low=0.0, high=100.0)
    solver: str = setting("exact", "Minimum in closed form, or by the paper's iteration", choices=(EXACT, DFP))
    every: int = setting(10, "Accepted samples between two estimates", low=1, high=10_000)
    min_creep: float = setting(1e-3, "Creep below which a sample says nothing", low=0.0, high=0.1)
    max_creep: float = setting(1.0, "Creep beyond which a sample is taken to be wrong", low=0.01, high=10.0)
    min_samples: float = setting(50.0, "Remembered samples below which the peak is withheld", low=4.0, high=1e6)
    max_relative_std: float = setting(
        0.03, "Relative standard deviation of mu_max above which it is withheld", "", 1e-4, 1.0
    )
    restart: bool = setting(True, "Forget everything when the surface changes, sooner than (13) does; not in the paper")
    confidence: float = setting(0.95, "One-sided confidence of the bounds of mu_max", low=0.5, high=0.9999)
    reset_s: float = setting(60.0, "Jump of the stamps, either way, that starts the identification anew", "s", 1.0, 1e6)

    def __post_init__(self) -> None:
        check_settings(self, "")
        if self.eta_min > self.eta_max:
            raise ValueError(f"eta_min = {self.eta_min}: choose at most eta_max, {self.eta_max}")
        parameters(self.slope, self.start_mu_max, self.start_lambda_m)

    @property
    def start(self) -> Array:
        """theta = (p1, p2) of the curve to start from."""
        return parameters(self.slope, self.start_mu_max, self.start_lambda_m)

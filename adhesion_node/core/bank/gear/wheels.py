# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the wheels tell of the axles: their radii, which of them slide, how fast the fastest is, whether all agree."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ...intake.samples import WheelSample
from .fastest import UNTOLD_NS, Fastest
from .radii import LEARNING_MPS, UNEQUAL, Radii
from .slides import Slides

if TYPE_CHECKING:
    from ...config import Config

S = 1_000_000_000

MANY = 3.0
"""Standard deviations of its speed by which a train surely runs."""

SPUN_NS = 3 * S
"""For so long behind traction axles that have spun may spin still."""

AGREE_NS, FEWEST = 2 * S, 3
"""Rims, so many or more, that are as fast as each other and as the train for so long roll: those that slide are not."""


class WheelsSeen(NamedTuple):
    """What is known of the axles."""

    radii: Radii = Radii()
    slides: Slides = Slides()
    fastest: Fastest = Fastest()
    agree_ns: int | None = None
    """Since when all of them are as fast as each other, and as the train."""
    pulled_ns: int | None = None
    """When the train was last pulled."""

    def after(
        self, config: Config, sample: WheelSample, speed_mps: float, std_mps: float, braked: bool, pulled: bool = False
    ) -> WheelsSeen:
        """Take in the speeds of all axles while that of one which rolls is known so.

        An axle slides where it is slower than the train, or than the fastest axle: a train is not slower than that. It
        rolls where neither can be. While a train is `pulled` driven axles may spin: no more is learnt of radii.
        """
        count, nothing = len(sample.speeds_radps), (None,) * len(sample.speeds_radps)
        wheels = self if len(self.radii.own) == count else WheelsSeen(Radii((1.0,) * count), Slides(nothing, nothing))
        rims = [each * config.train.wheel_radius_m for each in sample.speeds_radps]
        if braked and speed_mps < LEARNING_MPS:
            return wheels
        radii, slides = wheels.radii, wheels.slides.heard(sample.t_ns)
        if braked:
            own = [radius * rim for radius, rim in zip(radii.own, rims, strict=True)]
            slides = slides.after(config, own, sample.t_ns, speed_mps, std_mps)
        elif not (pulled and radii.is_learnt):
            radii = radii.after(rims, slides.every_ns, speed_mps - MANY * std_mps > LEARNING_MPS)
        return wheels._replace(radii=radii, slides=slides)

    def agreeing(self, rims: list[float], least_mps: float, t_ns: int) -> WheelsSeen:
        """Note whether all rims are as fast as each other, and as one that rolls is at least: then no fall counts."""
        apart = UNEQUAL + 2.0 * self.radii.by_chance(max(len(rims), 1))
        if len(rims) < FEWEST or min(rims) < max((1.0 - apart) * max(rims), least_mps):
            return self._replace(agree_ns=None)
        agreeing = self._replace(agree_ns=t_ns if self.agree_ns is None else self.agree_ns)
        return agreeing._replace(fastest=self.fastest._replace(fell_ns=None)) if agreeing.agree(t_ns) else agreeing

    def agree(self, now_ns: int) -> bool:
        """Whether all of them roll, as they have agreed for long enough."""
        return self.agree_ns is not None and now_ns - self.agree_ns >= AGREE_NS

    def all_roll(self, now_ns: int) -> bool:
        """Whether they agree and none has slid for long: protection may hold such as have at one creep."""
        return self.agree(now_ns) and not self.slides.any_slid(now_ns, UNTOLD_NS)

    def may_spin(self, now_ns: int) -> bool:
        """Whether driven axles may spin, as the train was pulled of late."""
        return self.pulled_ns is not None and now_ns - self.pulled_ns < SPUN_NS

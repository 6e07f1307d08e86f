# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""An accelerometer that turns out to lie: the train is followed anew, without it, from before the brake acted."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from ..belief.rail import Rail
from ..intake.samples import Measurement
from .following import followed
from .memory import Memory

if TYPE_CHECKING:
    from ..config import Config

MOST = 500
"""Measurements after which it is too late to go back."""


class Proving(NamedTuple):
    """What was believed before the first brake acted, and what was measured since, while nothing is proved."""

    before: Memory | None = None
    since: tuple[Measurement, ...] = ()

    def after(
        self, config: Config, before: Memory, memory: Memory, measurement: Measurement, rail: Callable[[], Rail]
    ) -> tuple[Memory, Proving]:
        """The train followed up to a measurement, and anew without the accelerometer where that is found to lie."""
        if memory.pointing.forward is None and memory.braked and len(self.since) < MOST:
            return memory, Proving(self.before or before, (*self.since, measurement))
        if memory.pointing.forward is not False or self.before is None:
            return memory, Proving()
        again = self.before._replace(pointing=memory.pointing, aside=memory.aside)
        for each in (*self.since, measurement):
            again = followed(config, again, each._replace(variance_m2=math.inf) if memory.aside else each, rail)
        return again, Proving()

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Wheels that turn otherwise than positions run while no brake is applied: in another unit, or of another radius."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .outcome import Event, Outcome
from .plausibility import PACE_NS, RUNS_MPS, RUNS_SPANS
from .samples import Measurement

UNLIKE, ALIKE = (0.7, 1.4), (0.8, 1.25)
"""How fast rims of wheels that roll may be over how fast positions run, and from when on they are believed again. A
worn wheel is 7 % smaller than a new one; rpm are 9.5 times rad/s, km/h on a wheel of 0.46 m 1.7 times, m/s half."""


class Turning(NamedTuple):
    """How fast rims are over how fast positions run, over the last spans of these without a brake."""

    since_ns: int | None = None
    position_m: float = 0.0
    shown: tuple[float, int] = (0.0, 0)
    """Sum and number of the speeds of rims of this span."""
    unlike: int = 0
    """Spans, one after the other, over which they were unlike."""
    ratio: float = 1.0

    @property
    def lies(self) -> bool:
        """Whether the wheels surely tell something else than rad/s of their radius."""
        return self.unlike >= RUNS_SPANS

    def after(self, measurement: Measurement, rims_mps: Sequence[float], braked: bool) -> Turning:
        """Note the next position, if there is one, and the rims that turned with it; under a brake none."""
        if braked:
            return self if self.since_ns is None else self._replace(since_ns=None)
        shown = self.shown[0] + sum(rims_mps), self.shown[1] + len(rims_mps)
        t_ns, position_m = measurement[:2]
        if not measurement.has_position:
            return self._replace(shown=shown) if rims_mps else self
        if self.since_ns is None or t_ns < self.since_ns:
            return Turning(t_ns, position_m, unlike=self.unlike, ratio=self.ratio)
        if t_ns - self.since_ns < PACE_NS:
            return self._replace(shown=shown) if rims_mps else self
        running_mps = abs(position_m - self.position_m) / ((t_ns - self.since_ns) * 1e-9)
        if not shown[1] or running_mps < RUNS_MPS:
            return Turning(t_ns, position_m, unlike=self.unlike, ratio=self.ratio)
        ratio, (least, most) = shown[0] / shown[1] / running_mps, ALIKE if self.lies else UNLIKE
        return Turning(t_ns, position_m, unlike=0 if least < ratio < most else self.unlike + 1, ratio=ratio)

    def believed(self, measurement: Measurement) -> tuple[Measurement, tuple[Event, ...]]:
        """Without wheels that lie, and what is to be told."""
        if not (self.lies and measurement.wheels):
            return measurement, ()
        event = Event(Outcome.WHEEL_UNIT, f"wheel_speed: rims at {self.ratio:.2g} times the speed of the positions")
        return measurement._replace(wheels=()), (event,)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whether a run has identified an adhesion, and if not, why: said instead of a prior that looks like a result."""

import math
from collections import deque
from collections.abc import Iterator

from ...core import Config, Estimate, Regime
from ...core.physics.train import KMH
from ..pipeline import BACKWARDS, Pipeline

BRAKES_MPS2, SPAN_S = 0.3, 3.0
"""A train that slows down less, over such a time, does not brake so that it tells of the adhesion."""

BRAKED_PA = 20e3
"""From this pressure on the brake works."""

FULL = 0.8
"""From this part of its pressure on the brake counts as full."""

PIPE_PA, RUNS_MPS2, RUNS_MPS = 2.5e5, 0.05, 5.0
"""A train with such a pressure in its cylinders does not run on, slowing down by less than this, at such a speed."""

FASTEST_MPS = 105.0
"""No train on rails is faster in service: 380 km/h."""

MANY = 0.2
"""A part of all that is more than a fault now and then."""

KNOWN_PART, KNOWN_MU = 0.4, 1.25 * Config().lowest_mu
"""A bound that is no more than this part of the adhesion, or this, says nothing but what was believed before."""


def is_known(mu: float, mu_lower: float, regime: str = "") -> bool:
    """Whether an estimate and its bound say more than what was believed before anything was seen.

    An adhesion that limits does, however low it is.

    >>> is_known(0.08, 0.07), is_known(0.08, 0.02), is_known(0.0225, 0.021, "ADHESION_LIMITED")
    (True, False, True)
    """
    return regime == Regime.ADHESION_LIMITED.name or mu_lower > max(KNOWN_PART * mu, KNOWN_MU)


class Seen:
    """Takes the estimates of a run as they come; keeps no more than what the newest seconds need."""

    def __init__(self, full_pa: float = math.inf) -> None:
        """Begin; at `full_pa`, gauge, the brake is full."""
        self._full_pa = full_pa
        self._full_mps2, self._full = 0.0, 0
        """Decelerations under the full brake, summed and counted."""
        self._limited = self._at_brake = self._told = self._open = 0
        """Estimates while the adhesion limited, while the brake did, while either may and what is used is known, and
        while either may in a braking."""
        self.hardest_mps2 = 0.0
        self.most_pa: float | None = None
        """Of the brake's pressure or demand; None: neither was measured."""
        self._at_least = 0.0
        """The highest bound while the brake limited."""
        self._estimates = self._moving = self._back = self._pressed = self._held = 0
        """Estimates, those of a train that runs, and of these: backwards, under pressure, in spite of that."""
        self._fastest_mps = 0.0
        self._newest: deque[tuple[int, float]] = deque()

    def follow(self, pipeline: Pipeline, newest: Estimate) -> None:
        """Take a pipeline's newest estimate; its speed is below 0 only where that is measured and not only foreseen."""
        speed_mps = newest.speed_mps if pipeline.is_shown else abs(newest.speed_mps)
        heard = pipeline.state.newest
        pressure_pa = None if heard is None else heard.brake_pressure_pa
        if heard is not None and pressure_pa is None:
            pressure_pa = heard.demand_pa
        self.note(newest.t_ns, newest.regime.name, newest.mu, newest.mu_lower, speed_mps, pressure_pa)

    def note(
        self, t_ns: int, regime: str, mu: float, mu_lower: float, speed_mps: float, pressure_pa: float | None
    ) -> None:
        """Take an estimate, and the pressure or demand of its time, gauge."""
        self._estimates += 1
        slows_mps2 = self._slows(t_ns, abs(speed_mps))
        if regime == Regime.ADHESION_LIMITED.name:
            self._limited += 1
        elif regime == Regime.BRAKE_LIMITED.name:
            self._at_brake += 1
            self._at_least = max(mu_lower, self._at_least)
        else:
            self._told += slows_mps2 >= BRAKES_MPS2 and is_known(mu, mu_lower)
            self._open += (pressure_pa or 0.0) >= BRAKED_PA and abs(speed_mps) > RUNS_MPS
        self.hardest_mps2 = max(self.hardest_mps2, 0.0 if math.isnan(slows_mps2) else slows_mps2)
        if pressure_pa is not None and pressure_pa >= FULL * self._full_pa and not math.isnan(slows_mps2):
            self._full_mps2 += slows_mps2
            self._full += 1
        if pressure_pa is not None:
            self.most_pa = max(pressure_pa, self.most_pa or 0.0)
        self._fastest_mps = max(abs(speed_mps), self._fastest_mps)
        if abs(speed_mps) > RUNS_MPS:
            self._moving += 1
            self._back += speed_mps < 0.0
            under_pressure = (pressure_pa or 0.0) > PIPE_PA
            self._pressed += under_pressure
            self._held += under_pressure and slows_mps2 < RUNS_MPS2

    def _slows(self, t_ns: int, speed_mps: float) -> float:
        """Deceleration over the newest `SPAN_S`, m/s^2; NaN until so much has come without a gap."""
        newest = self._newest
        if newest and not 0 < t_ns - newest[-1][0] < SPAN_S * 1e9:
            newest.clear()
        newest.append((t_ns, speed_mps))
        slowed = math.nan
        while t_ns - newest[0][0] >= SPAN_S * 1e9:
            before_ns, before_mps = newest.popleft()
            slowed = (before_mps - speed_mps) / (1e-9 * (t_ns - before_ns))
        return slowed

    @property
    def identified(self) -> bool:
        """Whether the adhesion limited, or may have for more than the first moments of a braking."""
        told = self._told if (self.most_pa or 0.0) >= BRAKED_PA else 0  # else it may be a brake that is seen
        is_open = self._limited > 0 or told > MANY * self._at_brake
        return is_open and not (self._runs_back or self._runs_on or self._fastest_mps > FASTEST_MPS)

    @property
    def full_mps2(self) -> float | None:
        """Mean deceleration under the full brake; None without one."""
        return self._full_mps2 / self._full if self._full else None

    @property
    def too_fast(self) -> str | None:
        """That no train is so fast; None of one that may be."""
        fast = f"{self._fastest_mps:.0f} m/s, {self._fastest_mps / KMH:.0f} km/h"
        remedy = "is its speed in km/h, are its positions or times in another unit?"
        return f"the train runs {fast}: {remedy}" if self._fastest_mps > FASTEST_MPS else None

    @property
    def _runs_back(self) -> bool:
        return self._back > MANY * self._moving

    @property
    def _runs_on(self) -> bool:
        """Whether the brake seems to do nothing."""
        return self._held > MANY * self._pressed

    def why_not(self, odd_brake: str | None = None) -> str | None:
        """Say why nothing is identified; None where something is."""
        return None if self.identified else next(self._reasons(odd_brake))

    def _reasons(self, odd_brake: str | None) -> Iterator[str]:
        """What may be the reason, the one that explains most first."""
        if not self._estimates:
            yield "no estimate came of it; see what was dropped, and why, or is it too short?"
        if self._runs_back:
            yield BACKWARDS
        if self.too_fast is not None:
            yield self.too_fast
        if odd_brake is not None:
            yield odd_brake
        if self.most_pa is None:
            yield "no brake pressure and no demand came: without them it is not told whether the adhesion limits"
        elif self.most_pa < BRAKED_PA:
            yield f"the brake pressure is {self.most_pa:.3g} Pa at most: is its unit right, was there a braking?"
        if self._runs_on:
            yield "the train runs on under brake pressure: is it the brake pipe's, or absolute and taken as gauge?"
        if not self._moving:
            yield f"the train was never faster than {self._fastest_mps:.2g} m/s: are its positions degrees, or km?"
        if self.hardest_mps2 < BRAKES_MPS2:
            yield f"no braking harder than {BRAKES_MPS2:g} m/s^2: the hardest was {self.hardest_mps2:.2f}"
        if self._at_brake > self._open:
            yield f"the brake limited throughout: the adhesion is at least {self._at_least:.2g}"
        yield (
            f"braked by up to {self.hardest_mps2:.2f} m/s^2, and a weaker brake would look the same as a slippery rail:"
            " wheel speeds tell, a speed by radar or Doppler (speed_source), or a brake known better (brake_std)"
        )

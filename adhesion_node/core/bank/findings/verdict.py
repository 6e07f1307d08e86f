# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the bank's hypotheses say together: what limits, and the adhesion that is used."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...belief.rail import Rail
from ...belief.regime import Regime
from ..following import SPEED_ERROR_MPS
from ..gear.slides import BRAKE_BELOW
from ..labels.laws import SLIPPERY
from ..memory import Memory
from ..motion import ANOTHER, SLOWED, resistance, use
from .ahead import (
    KNOWN_SHARE,
    PARTIAL,
    Ahead,
    borne_out,
    counted_on,
    for_the_fastest,
    is_partial,
    quantiles,
    surely,
    unfelt,
)

if TYPE_CHECKING:
    from ...config import Config

LOW_95, HIGH_95 = 0.025, 0.975
"""Probabilities at both ends of an interval of 95 %."""

WIDTH_95 = 3.92
"""Width of the 95 % interval of a Gaussian over its standard deviation."""

SLOWING = 0.02
"""Net deceleration over g from which a train brakes of whose brake nothing is known."""

LIKELY = 0.5
"""Probability of sliding from which what is used is what the rail gives."""

SLIDES_FROM, CLAIMED = 0.5, 0.8
"""Share of sliding axles that leaves no doubt, and the probability from which something is claimed without them."""

DOUBTS, UNDUMPED = 2.0, 3.0
"""Errors of the brake by which less is used than it should give, from which axles slide that nobody sees; where a gauge
would show that slide protection lets go of cylinders, and does not, or a single axle is heard and rolls, sooner the
brake is weak."""

HELD_BACK = 3.0
"""Errors of the brake by which less is used than it should give, from which all axles may be held at some creep."""

SURGING = 2.0
"""Times the ripple of this train by which the adhesion used may swing more where slide protection fills slowly or lets
go of whole bogies. No sensor tells that from its own errors in time, so the bound allows for it on any train."""

SPEED_ERROR = np.diag([0.0, SPEED_ERROR_MPS**2])


class Findings(NamedTuple):
    """What is made of a bank."""

    regime: Regime
    rail: Rail
    ahead: Ahead
    known: Rail
    """What it teaches of the rail: where the brake limits, that it gives at least so much."""


def found(config: Config, memory: Memory, before: Rail, nothing: Rail) -> Findings:
    """Judge the bank; `before` is the rail as it was known, aged to now, `nothing` what is known of any rail."""
    bank = memory.bank
    if memory.misled:
        lower = min(nothing.lower, surely(config, bank))
        return Findings(Regime.COASTING, nothing, for_the_fastest(config, bank, lower)[0], nothing)
    used = use(config, bank, memory.braking, resistance(config, bank))
    std, missed = used.std(config, bank), KNOWN_SHARE * (1.0 - config.confidence)
    low, middle, high = quantiles(bank.weight, used.value, std, (LOW_95, 0.5, HIGH_95))
    if memory.brake.known and not (memory.braked or _is_slowed(config, memory, low, high)):
        return Findings(Regime.COASTING, before, unfelt(config, bank, before.lower), before)
    surging = np.hypot(std, SURGING * config.ripple * used.value)
    bound = float(quantiles(bank.weight, used.value, surging, (missed,)).item())
    rail = Rail(max(middle, 0.0), (high - low) / WIDTH_95, min(max(bound, 0.0), max(middle, 0.0)))
    if not memory.brake.known:
        free = before
        if rail.mu > SLOWING:
            free = rail._replace(lower=max(rail.lower, min(before.lower, rail.mu)))
        return Findings(Regime.COASTING, free, unfelt(config, bank, before.lower), free)
    missed = KNOWN_SHARE * (1.0 - config.curve_confidence)
    was = memory.known if memory.braked else before
    ahead = counted_on(config, borne_out(memory), missed, memory.braking, was, used)
    slides, regime, least = float(bank.weight @ used.slides), Regime.COASTING, was.lower
    if rail.std > config.undecided_share * config.unknown_std:
        least = min(before.lower, least)
    else:
        regime = _regime(config, memory, slides, rail.mu)
        rolls = slides <= LIKELY and regime is not Regime.ADHESION_LIMITED
        least = least if is_partial(config, memory.braking, rail.mu) and rolls else 0.0
    floor, is_lost = for_the_fastest(config, bank, min(least, surely(config, bank)))
    lower = max(rail.lower, least)
    ahead = for_the_fastest(config, bank, lower)[0] if is_lost else ahead.at_least(floor)
    rail = rail._replace(lower=min(lower, rail.mu))
    known = rail if slides > LIKELY else Rail(max(before.mu, rail.mu), max(before.std, rail.std), lower)
    # else it may be a grade, a brake on the rail itself, or one that is released
    is_shown = memory.braked and memory.is_pressed(config) and not memory.brake.lets_go(config)
    return Findings(regime, rail, ahead, known if is_shown else before)


def _is_slowed(config: Config, memory: Memory, low: float, high: float) -> bool:
    """Whether a brake surely slows the train down though the gauge shows none."""
    return memory.braking.alone and low > SLOWED and high < ANOTHER * config.train.full_brake


def _regime(config: Config, memory: Memory, slides: float, mu: float) -> Regime:
    """What limits: the wheels know best; else nothing is claimed that a wrong brake could explain as well."""
    share = memory.wheels.slides.share(memory.t_ns)
    demanded = config.train.specific_brake(memory.brake.demanded_pa)
    part, error, fell = mu / max(demanded, 1e-6), config.brake_error, memory.brake.has_fallen(memory.t_ns)
    if share is not None and share >= SLIDES_FROM:
        return Regime.ADHESION_LIMITED
    if not memory.is_pressed(config):
        return Regime.COASTING
    if share is not None and share < BRAKE_BELOW:
        return Regime.BRAKE_LIMITED if part > 1.0 - HELD_BACK * error and not fell else Regime.COASTING
    alone = config.pressure_kind == "cylinder"  # the axle that is heard may be the only one that slides
    dumped = memory.braking.told > 0.0 and (part < 1.0 - error or not alone)
    gauge = memory.brake.gauged and config.pressure_kind != "demanded"
    shows = gauge or memory.wheels.slides.one_rolls(memory.t_ns)
    if slides > CLAIMED and (dumped or part < 1.0 - (UNDUMPED if shows else DOUBTS) * error):
        return Regime.ADHESION_LIMITED
    dumps = config.pressure_kind == "mean" and demanded < PARTIAL * config.train.full_brake
    weak = config.train.full_brake <= SLIPPERY  # a film may give what such a brake asks for, to within its error
    near = 1.0 - error < part < 1.0 + 2.0 * error  # more than the brake can give is another one's
    if share is None and slides < 1.0 - CLAIMED and near and not (dumps or weak or fell):
        return Regime.BRAKE_LIMITED
    return Regime.COASTING

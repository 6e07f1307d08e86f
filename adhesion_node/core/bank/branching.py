# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How hypotheses come and go: a braking opens, the rail or the limit may have changed, the unlikely end.

Hypotheses are never blended into each other while they differ: a rail that is smooth stays known as smooth. What may
have changed is a new hypothesis beside the old one (multiple hypotheses, as in tracking), and evidence decides.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..belief.rail import Rail
from .free import by_noise
from .gear.slides import FALLS
from .kernels import springing, uniting
from .kernels.springing import Rule
from .kernels.uniting import Pruning
from .labels.kinds import HELD, KINDS, OTHER, PASSING, SLIDING, roughness_of
from .labels.laws import LEVELS, law_priors
from .layout import MU, ROUGH, Bank
from .motion import Braking, rolling_use

if TYPE_CHECKING:
    from ..config import Config

LEAST, MOST = 1e-4, 44
"""Probability below which a hypothesis ends, and how many there may be."""

WIDE, SPLIT, SPLIT_STD = 0.3, (-1.2, -0.4, 0.4, 1.2), 0.5
"""Adhesion is above 0 and known in proportion. Where its logarithm is known worse than so, it is divided into
Gaussians: so many of its standard deviations off, each with this share of it."""

BOUND_STD = 1.645
"""Standard deviations from which a bound counts as one of 95 %."""

LEAST_MU, LEAST_PART, LEAST_STD = 0.005, 0.1, 0.02
"""What is known of a rail is no less than so, its bound no less a part of it, and its logarithm no better."""

STRONG = 0.03
"""Probability from which a hypothesis has others spring from it."""

LESS, LESS_STD, LESS_LEAST_STD = (0.9, 0.6, 0.4, 0.25), 0.22, 0.003
"""Parts of what the brake needs that a rail may give on which axles begin to slide, each known so well: in proportion,
and as adhesion, as a brake that hardly presses tells little of a rail. Without the latter, on a seed of `study real`,
the safe curve exceeds the way by 37 instead of 32 % on leaves where one cylinder is heard; else by about as much."""

PASSING_S, PASSED_S = 300.0, 3.0
"""A border of the rail comes once in that time, and the train takes so long to pass it."""

OTHER_S, ENDED_S, MORE, UNNEEDED = 60.0, 20.0, (0.03, 0.03), 0.01
"""Another brake, which no gauge shows, begins to work once in that time, and ends in that. So much more is used then
than the known one needs, known so well; of one that is seen to give no more so much is left, twice a second."""

CHANGE_S, BEND_S = 600.0, 60.0
"""Axles roll again, whatever the adhesion was, once in that time, and how it depends on speed changes."""

REACHED = 0.98
"""Part of what the brake presses with from which it no longer reaches the adhesion: the last axles slide no more. With
1 instead, on a seed of `study real`, the truth is covered 1 to 4 % of the time less on rough and patched rails by
positions alone; all else is nearly as it was."""

RISING_S, RISES, STEADY_S, FELL_S, REACHED_S = 5.0, 2.0, 60.0, 0.5, 2.0
"""In such times axles begin to slide while the brake is applied harder, in so many build-ups of a slow brake, while it
is not, and while all of them are seen to fall; and adhesion that the brake no longer reaches lets them roll."""

ALIKE, ALIKE_STD = 0.3, 1.4
"""Hypotheses of one label say the same where speed and adhesion differ by less than this part of their standard
deviations, and these by less than this factor."""

SLIDING_PRIORS = np.array([kind.prior if kind.slides else 0.0 for kind in KINDS])

PRUNING = Pruning(math.log(LEAST), MOST, ALIKE, ALIKE_STD)


def opened(config: Config, bank: Bank, rail: Rail, alone: bool) -> Bank:
    """A braking begins on a rail that is known so: every law, every kind. `rail.lower` is a bound of `BOUND_STD`.

    What is known badly is divided into parts that are narrow enough for each to know when its axles begin to slide.
    Where a gauge of cylinders is `alone` another brake may work beside.
    """
    mu = max(rail.mu, LEAST_MU)
    std = math.log(mu / min(max(rail.lower, LEAST_PART * mu), mu / (1.0 + LEAST_STD))) / BOUND_STD
    steps = [(step * std, SPLIT_STD * std) for step in SPLIT] if std > WIDE else [(0.0, std)]
    roughness, bank = roughness_of(config), by_noise(bank)
    parts, laws = [(HELD, 0, mu, std * mu, 0.0, math.log(KINDS[HELD].prior))], law_priors(config)
    if alone:
        parts.append((OTHER, 0, *MORE, 0.0, math.log(KINDS[OTHER].prior)))
    for law in range(len(laws)):
        for kind in SLIDING:
            grows = KINDS[kind].growth != 0.0  # as much as any law does, so that none of them matters
            for off, within in steps:
                middle = mu * math.exp(off)
                share = float(law == len(laws) - 1) if grows else springing.law_prior(laws, LEVELS, law, middle)
                prior = KINDS[kind].prior * share / len(steps)
                if prior > 0.0:
                    parts.append((kind, law, middle, within * middle, roughness[kind], math.log(prior)))
    count = bank.kind.size
    kinds, law_of, means, stds, rough, priors = (np.repeat(column, count) for column in zip(*parts, strict=True))
    every = bank.part(np.tile(np.arange(count), len(parts)))
    fresh = every.with_fresh(MU, means, stds).with_fresh(ROUGH, 0.0, rough)
    return fresh.labelled(kinds, law_of, -math.inf, priors).normalised()


def branched(config: Config, bank: Bank, braking: Braking, now_s: float, elapsed_s: float) -> Bank:
    """With what may have become different within the last `elapsed_s`, beside what springs from it.

    Of those that slide: adhesion depends otherwise on speed; or has become more than the brake uses, likelier the
    nearer it was; or the train passes a border: what it uses drifts meanwhile, as a long train takes seconds to, and
    lasts again behind it. Of those that roll: adhesion has become less
    than the brake needs, a little less while the brake rises, else any less. Where the wheels tell which it is, the
    other does not spring. Another brake, which no gauge shows, begins to work, or ends.
    """
    fell, rising_s = braking.told >= FALLS, max(RISING_S, RISES * config.brake_build_up_s)
    rule = Rule(
        now_s=now_s,
        elapsed_s=elapsed_s,
        strong=STRONG,
        change_s=CHANGE_S,
        bend_s=BEND_S,
        begin_s=FELL_S if fell else rising_s if braking.rising else STEADY_S,
        reached_s=REACHED_S,
        reached=REACHED,
        passing=PASSING,
        passing_s=PASSING_S,
        passed_s=PASSED_S,
        other=OTHER,
        other_s=OTHER_S if braking.alone else math.inf,
        ended_s=ENDED_S,
        more=np.array(MORE),
        unneeded=UNNEEDED,
        less=np.array(LESS[:1] if braking.rising and not fell else LESS),
        less_std=LESS_STD,
        least_std=LESS_LEAST_STD,
        applied=float(braking.applied),
        told=float(braking.told) if braking.is_sure else 0.0,
        laws=law_priors(config),
        levels=LEVELS,
        sliding=np.column_stack((roughness_of(config), SLIDING_PRIORS)),
    )
    return Bank(*springing.branched(bank, rolling_use(config, bank, braking), rule)).normalised()


def pruned(bank: Bank) -> Bank:
    """Without the unlikely, and with what says the same said once: it is united, the likelier one first."""
    return Bank(*uniting.pruned(bank[:], PRUNING[:]))

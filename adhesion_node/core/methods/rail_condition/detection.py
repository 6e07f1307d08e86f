# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which change a window has seen, if any: of the rail, or a step of the measured positions, as a balise causes it.

A step explains any error of the positions for a while, so it has to be rare: two steps lie a distance apart, and
behind each the speed is less certain, because a speed that was wrong would have looked the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .branch import Branch
from .changes import Change, change, position_step
from .hypotheses import Hypothesis, hypotheses, scaled, widened

if TYPE_CHECKING:
    from ...config import Config


class Detected(NamedTuple):
    """A change within the window."""

    hypotheses: tuple[Hypothesis, ...]
    """At the newest sample."""
    of_rail: bool
    """Of the rail, or only of the positions' origin."""
    certain: bool
    """Whether it has happened; else the rail is taken as it was, until the next windows tell."""


def detect(config: Config, branches: Sequence[Branch], leading: Branch, stepped_m: float) -> Detected | None:
    """Find the change, of the rail or of the positions, that explains the window better than none.

    `stepped_m` is the position of the last step, minus infinity for none. Within `position_step_spacing_m` of it,
    what a step would explain best counts as an error of the positions.
    """
    window = leading.problem.window
    if window.steps < 2 * config.change_edge:
        return None
    rail, step = _rail_change(config, leading), _position_step(config, leading)
    if max(rail.log_odds, step.log_odds) < config.change_threshold:
        return None
    if rail.log_odds > step.log_odds + config.change_margin:
        belief = scaled(rail.belief, float(leading.before.law(rail.belief.mean[1])))
        opened = hypotheses(config.speed_law, config.low_law, config.law_probability, belief)
        return Detected(opened, of_rail=True, certain=True)
    if abs(float(window.position_m[-1]) - stepped_m) < config.position_step_spacing_m:
        return None
    needed = max(config.change_threshold + config.position_step_log_odds, rail.log_odds + config.change_margin)
    lasts_s = float(np.sum(window.dt_s))
    # the hypotheses as they weighed before: each explains a part of the step as best it can
    return Detected(
        tuple(_stepped(config, each, lasts_s) for each in branches), of_rail=False, certain=step.log_odds > needed
    )


def _stepped(config: Config, branch: Branch, lasts_s: float) -> Hypothesis:
    """The hypothesis behind a step; a speed wrong by size / `lasts_s` would have moved the positions as far."""
    step = _position_step(config, branch)
    wrong_mps = config.position_step_speed_share * step.size / lasts_s
    return branch.before._replace(belief=widened(step.belief, 1, wrong_mps**2))


def _rail_change(config: Config, branch: Branch) -> Change:
    before, last = branch.before, branch.problem.window.steps - config.change_edge
    jump_std = config.unknown_std / float(before.law(before.belief.mean[1]))
    candidates = np.arange(config.change_edge, last + 1, dtype=np.intp)
    return change(branch.problem, branch.smoothed, candidates, jump_std)


def _position_step(config: Config, branch: Branch) -> Change:
    last = branch.problem.window.steps - config.change_edge + 2
    candidates = np.arange(config.change_edge, last + 1, dtype=np.intp)
    return position_step(branch.problem, branch.smoothed, candidates, config.position_step_std_m)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a method is: a value that opens, extends and evaluates the sliding window of one braking.

A window grows to S measurements, then moves on by L (steps 1, 4 and 5 of the paper). What else it holds is the
method's own; the estimator keeps it between two measurements and never looks inside.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import numpy as np

from ..belief.gaussian import Gaussian
from ..belief.rail import Rail
from ..belief.regime import Regime
from ..belief.window import WindowSample
from ..physics.adhesion import SpeedLaw

if TYPE_CHECKING:  # Config offers the methods' names, so it stands above them
    from ..config import Config


class MethodWindow(Protocol):
    """A method's window of one braking, immutable."""

    @property
    def samples(self) -> tuple[WindowSample, ...]:
        """Its measurements; the first one shaped the belief of (s, v) that the window began with."""
        ...


class Context(NamedTuple):
    """What is known beside the window when it is evaluated."""

    rail: Rail
    """The rail as it was known, aged to now."""
    mu: float | None
    """Adhesion that the last window gave, to start from (12); None before the first window."""
    pressure_measured: bool
    """Else a full brake is assumed, and traction may be at work."""
    lowest_mu: float
    """Least net adhesion to look for: 0, or a negative number where traction may be at work."""
    rng: np.random.Generator
    """The window's own random stream."""


class Fit(NamedTuple):
    """How a window was evaluated, or what the bank did; an estimate tells it as it is."""

    window: int = 0
    """Measurements in the window, of the bank: of the present braking so far; 0 where there is none."""
    iterations: int = 0
    """Until the window's fit converged; of the bank, which looks at every measurement once, 1 within a braking."""
    converged: bool = True
    """Always so of the bank."""
    log_likelihood: float = 0.0
    """Of the window's measurements; of the bank: of those since the last estimate, foreseen one by one."""
    ess: float = 0.0
    """Smallest effective sample size in the window, 0 where no particles were used; of the bank: of its hypotheses."""
    shape: SpeedLaw | None = None
    """How mu goes on, up to a factor, as the train slows down; None: nothing is known of it."""


class Verdict(NamedTuple):
    """What is made of a window."""

    regime: Regime
    rail: Rail
    belief: Gaussian
    """Of (s, v) at the newest sample."""
    window: MethodWindow | None
    """To go on with."""
    mu: float | None = None
    """Adhesion for the next window to start from (12); None leaves it as it was."""
    changed: bool = False
    """Whether the rail has changed within the window."""
    fit: Fit = Fit()


Window = TypeVar("Window", bound=MethodWindow)


class Method(Protocol[Window]):
    """Identifies the adhesion; a value without state of its own, all that it remembers is in its window."""

    @property
    def summary(self) -> str:
        """What it does, for the description of the setting `method`."""
        ...

    def open(self, prior: Gaussian, sample: WindowSample, replaced: Window | None = None) -> Window:
        """Open a window at a sample; `prior` is the belief of (s, v) there, the sample included.

        `replaced` is the window that it takes the place of within a braking, as that had lost the train.
        """
        ...

    def extend(self, window: Window, sample: WindowSample) -> Window:
        """Return the window with one more sample."""
        ...

    def evaluate(self, config: Config, window: Window, context: Context) -> Verdict:
        """Judge a window of at least two samples, and move it on where it is full."""
        ...


AnyMethod = Method[Any]


def spent(config: Config, samples: Sequence[WindowSample]) -> int:
    """Samples to leave behind, so that L more fill the window again; 0 while it still grows."""
    count = len(samples) - config.window + config.step
    return count if count >= config.step else 0

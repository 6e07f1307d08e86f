# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""From the present window to an `Estimate`: regime, adhesion with its bound, position and speed."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .bank import BANK
from .bank.findings.ahead import Ahead
from .belief import tracker
from .belief.gaussian import Gaussian
from .belief.rail import Rail, age, ignorance
from .belief.regime import Regime
from .config import Config
from .intake.plausibility import STRONGEST_MPS2
from .intake.samples import Measurement
from .methods.protocol import AnyMethod, Context, MethodWindow, Verdict
from .physics.adhesion import SpeedLaw
from .quick import quick


@quick
class Estimate(NamedTuple):
    """What is known at `t_ns`, the time of the newest measurement."""

    t_ns: int
    mu: float
    mu_std: float
    mu_lower: float
    """One-sided lower bound of mu at the configured confidence."""
    regime: Regime
    position_m: float
    speed_mps: float
    """Signed: below 0 positions fall."""
    position_std_m: float
    speed_std_mps: float
    changes: int = 0
    """Changes of the rail found so far."""
    window: int = 0
    """This and the following as in `Fit`."""
    iterations: int = 0
    converged: bool = True
    log_likelihood: float = 0.0
    ess: float = 0.0
    shape: SpeedLaw | None = None
    withheld: bool = False
    """Nothing is known of mu, not even by its age: it is the low-adhesion law's."""
    ahead: Ahead | None = None
    """What a safe curve may count on; None: `mu_lower`."""


class Knowledge(NamedTuple):
    """What the windows so far have taught."""

    windows: int = 0
    """Windows evaluated; numbers their random streams."""
    mu: float | None = None
    """Adhesion that the last window gave, the next one's start (12)."""
    changes: int = 0
    """Changes of the rail found."""
    rail: Rail | None = None
    t_ns: int = 0
    position_m: float = 0.0
    """When and where the rail was known so."""
    astray_ns: int | None = None
    """Since when the speed of the windows has been away from the tracker's; None: it is not."""

    def aged(self, config: Config, t_ns: int, belief: Gaussian, nothing: Rail) -> Rail:
        """The rail as it was known, aged to `t_ns` and the belief of (s, v); before the first window `nothing`."""
        if self.rail is None:
            return nothing
        elapsed = (t_ns - self.t_ns) * 1e-9 / config.memory_s
        travelled = abs(float(belief.mean[0]) - self.position_m) / config.memory_m
        return age(self.rail, nothing, elapsed + travelled)

    def after(self, t_ns: int, verdict: Verdict, learnt: Rail | None = None) -> Knowledge:
        """What is known after a verdict, of the rail what is `learnt`, if that is not what is told."""
        return Knowledge(
            windows=self.windows + (verdict.fit.window > 0),
            mu=self.mu if verdict.mu is None else verdict.mu,
            changes=self.changes + verdict.changed,
            rail=verdict.rail if learnt is None else learnt,
            t_ns=t_ns,
            position_m=float(verdict.belief.mean[0]),
        )


def unknown(config: Config, speed_mps: float) -> Rail:
    """What is known of any rail at a speed."""
    lowest = config.lowest_mu if config.method == BANK else math.inf
    return ignorance(float(config.low_law(np.asarray(abs(speed_mps)))), config.unknown_std, lowest)


def judge(
    config: Config,
    method: AnyMethod,
    seed: int,
    newest: Measurement,
    belief: Gaussian,
    window: MethodWindow | None,
    knowledge: Knowledge,
) -> tuple[Verdict, Knowledge]:
    """Evaluate the window, if there is one, on top of what was known; `belief` is the tracker's at `newest`.

    The tracker knows less but assumes less. Windows whose speed has been `restart_sigma` away from its own for
    `restart_s` have lost the train, be it by steps of the positions that were none: what they taught is forgotten, and
    a new one begins at the tracker's belief. For a moment it is the tracker that is off, behind a true step.
    """
    t_ns, nothing = newest.t_ns, unknown(config, float(belief.mean[1]))
    rail = knowledge.aged(config, t_ns, belief, nothing)
    if window is None or len(window.samples) < 2:
        verdict = Verdict(Regime.COASTING, rail, belief, window)
        return verdict, knowledge.after(t_ns, verdict)
    measured = newest.brake_pressure_pa is not None
    context = Context(
        rail=rail,
        mu=knowledge.mu,
        pressure_measured=measured,
        lowest_mu=0.0 if measured else config.lowest_net_mu,
        rng=np.random.default_rng([seed, knowledge.windows]),
    )
    verdict = method.evaluate(config, window, context)
    known = knowledge.after(t_ns, verdict)
    if tracker.speed_apart(belief, verdict.belief) < config.restart_sigma:
        return verdict, known
    since = t_ns if knowledge.astray_ns is None else knowledge.astray_ns
    if t_ns - since < config.restart_s * 1e9:
        return verdict, known._replace(astray_ns=since)
    anew = Knowledge(windows=known.windows, changes=known.changes)
    opened = method.open(belief, window.samples[-1], window)
    restarted = Verdict(Regime.COASTING, nothing, belief, opened)
    return restarted, anew.after(t_ns, restarted)


def estimate_of(
    t_ns: int, verdict: Verdict, changes: int, ahead: Ahead | None = None, withheld: bool = False
) -> Estimate:
    """Tell a verdict; `changes` of the rail were found so far."""
    rail, belief, fit = verdict.rail, verdict.belief, verdict.fit
    position, speed = (float(value) for value in belief.mean)
    return Estimate(
        t_ns=t_ns,
        mu=rail.mu,
        mu_std=rail.std,
        mu_lower=rail.lower,
        regime=verdict.regime,
        position_m=position,
        speed_mps=speed,
        position_std_m=belief.position_std,
        speed_std_mps=belief.speed_std,
        changes=changes,
        withheld=withheld,
        ahead=ahead,
        **fit._asdict(),
    )


def blind_estimate(config: Config, before: Estimate, t_ns: int) -> Estimate:
    """What a consumer may count on without positions since `before`: what holds of any rail, the speed not lost yet."""
    unseen_s = (t_ns - before.t_ns) * 1e-9
    rail = unknown(config, before.speed_mps)
    return before._replace(
        t_ns=t_ns,
        mu=rail.mu,
        mu_std=rail.std,
        mu_lower=rail.lower,
        regime=Regime.COASTING,
        position_m=before.position_m + before.speed_mps * unseen_s,
        position_std_m=before.position_std_m + STRONGEST_MPS2 * unseen_s**2 / 2,
        speed_std_mps=before.speed_std_mps + STRONGEST_MPS2 * unseen_s,
        window=0,
        iterations=0,
        withheld=True,
        ahead=None,
    )

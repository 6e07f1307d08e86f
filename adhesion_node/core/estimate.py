# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""From the present window to an `Estimate`: regime, adhesion with its bound, position and speed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .belief.gaussian import Gaussian
from .belief.outcome import Regime
from .belief.rail import Rail, age, ignorance
from .config import Config
from .intake.samples import Measurement
from .methods.particle_em.em import Search
from .methods.particle_em.method import Evaluate, evaluate, judge
from .methods.protocol import BrakingWindow, Verdict
from .methods.rail_condition.method import evaluate_condition
from .physics.adhesion import SpeedLaw

LOWEST_NET_ADHESION = -0.05
"""Where the brake pressure is not measured, traction may be at work: the net force may point forward."""


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
    position_std_m: float
    speed_std_mps: float
    window: int = 0
    """Measurements in the window; 0 where none was evaluated."""
    iterations: int = 0
    converged: bool = True
    log_likelihood: float = 0.0
    ess: float = 0.0
    """Smallest effective sample size in the window; 0 where no particles were used."""
    changes: int = 0
    """Changes of the rail found so far."""
    shape: SpeedLaw | None = None
    """How mu goes on, up to a factor, as the train slows down; None: nothing is known of it."""


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


class Result(NamedTuple):
    """An estimate and what it leaves behind."""

    estimate: Estimate
    knowledge: Knowledge
    law: Gaussian
    """Of (s, v) at the estimate; the window's where there is one."""
    window: BrakingWindow | None
    """To go on with."""


def estimate(
    config: Config,
    seed: int,
    newest: Measurement,
    law: Gaussian,
    window: BrakingWindow | None,
    knowledge: Knowledge,
    evaluate: Evaluate = evaluate,
) -> Result:
    """Evaluate the window, if there is one, on top of what was known; `law` is the tracker's at `newest`."""
    rail = _aged(config, newest, law, knowledge)
    if window is None or len(window.samples) < 2:
        return _result(newest, law, window, knowledge, rail, Regime.COASTING)
    unmeasured = newest.brake_pressure_pa is None
    lowest = LOWEST_NET_ADHESION if unmeasured else 0.0
    if config.method == "particle_em":
        start = config.start_mu if knowledge.mu is None else knowledge.mu
        search = Search(start, config.iterations, config.tolerance, lowest)
        evaluation = evaluate(config, window, search, np.random.default_rng([seed, knowledge.windows]))
        verdict = judge(config, evaluation, rail, start, unmeasured)
    else:
        verdict = evaluate_condition(config, window, rail, config.start_mu if knowledge.mu is None else None, lowest)
        if unmeasured and verdict.rail.mu <= 2.0 * verdict.rail.std:
            verdict = verdict._replace(regime=Regime.COASTING, rail=rail)
    return _judged(newest, window, knowledge, verdict)


def _aged(config: Config, newest: Measurement, law: Gaussian, knowledge: Knowledge) -> Rail:
    """The rail as it was known, aged to now; ignorance before the first window."""
    nothing = ignorance(float(config.low_law(law.mean[1])), config.unknown_std)
    if knowledge.rail is None:
        return nothing
    elapsed = (newest.t_ns - knowledge.t_ns) * 1e-9 / config.memory_s
    travelled = abs(float(law.mean[0]) - knowledge.position_m) / config.memory_m
    return age(knowledge.rail, nothing, elapsed + travelled)


def _judged(newest: Measurement, window: BrakingWindow, knowledge: Knowledge, verdict: Verdict) -> Result:
    knowledge = knowledge._replace(
        windows=knowledge.windows + 1, mu=verdict.mu, changes=knowledge.changes + verdict.changed
    )
    result = _result(newest, verdict.law, verdict.following, knowledge, verdict.rail, verdict.regime)
    return result._replace(
        estimate=result.estimate._replace(
            window=len(window.samples),
            iterations=verdict.iterations,
            converged=verdict.converged,
            log_likelihood=verdict.log_likelihood,
            ess=verdict.ess,
            shape=verdict.shape,
        )
    )


def _result(
    newest: Measurement,
    law: Gaussian,
    window: BrakingWindow | None,
    knowledge: Knowledge,
    rail: Rail,
    regime: Regime,
) -> Result:
    position, speed = (float(value) for value in law.mean)
    known = knowledge._replace(rail=rail, t_ns=newest.t_ns, position_m=position)
    estimate = Estimate(
        t_ns=newest.t_ns,
        mu=rail.mu,
        mu_std=rail.std,
        mu_lower=rail.lower,
        regime=regime,
        position_m=position,
        speed_mps=max(speed, 0.0),
        position_std_m=law.position_std,
        speed_std_mps=law.speed_std,
        changes=knowledge.changes,
    )
    return Result(estimate, known, law, window)

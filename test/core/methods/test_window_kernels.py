# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The compiled loops of a window under rail condition: against dense matrices of NumPy, to rounding."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import numpy_window as by_numpy
import pytest
from oracles import Array

from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.kernels import equation, jumps
from adhesion_node.core.methods.rail_condition.problem import Belief, Model, Problem
from adhesion_node.core.methods.rail_condition.smoother import KappaSearch, Smoothed, posterior, smooth
from adhesion_node.core.physics.adhesion import WET, SpeedLaw
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.physics.train import Train

PRIOR = Belief(np.array([100.0, 80.0, 0.9]), np.array([[0.25, 0.02, 0.01], [0.02, 0.02, -0.005], [0.01, -0.005, 0.04]]))
SLOPED = Motion(
    Train(rotating_mass_fraction=0.08), Track((Grade(150.0, 220.0, 1.0), Grade(190.0, 900.0, -3.0))), 4e-3, 3e-4
)
LEVEL = Motion(Train(), Track(), 4e-3, 3e-4)
FULL, TIMID = 0.0952, np.linspace(0.02, 0.0952, 40)


def _case(motion: Motion, brake: float | Array, dof: float, law: SpeedLaw = WET) -> tuple[Problem, Array]:
    """A window with gaps, some measured speeds and an outlier, and a trajectory near it."""
    rng, count = np.random.default_rng(4), 40
    dt = np.where(np.arange(count) % 9 == 0, 0.3, 0.1)
    speed = 80.0 - 0.9 * np.cumsum(dt)
    position = 100.0 + np.cumsum(dt * (speed + 0.45 * dt))
    radar = np.where(np.arange(count) % 5 == 0, 0.04, math.inf)
    seen = position + 0.5 * rng.standard_normal(count) + 9.0 * (np.arange(count) == 11)
    window = Window(
        dt, np.full(count, brake) if np.isscalar(brake) else np.asarray(brake), seen, np.full(count, 0.25), speed, radar
    )
    near = np.column_stack((np.append(100.0, position), np.append(80.0, speed))) + 0.05 * rng.standard_normal((41, 2))
    return Problem(Model(motion, law, dof), window, PRIOR), near


OF = {
    "bank": set[str](),
    "rail_condition": {
        *("equation.solved", "equation.smoothed", "equation.posterior", "equation.covariance_at_end"),
        *("equation.position_variances", "jumps.of_kappa", "jumps.of_positions", "jumps.tried", "jumps.moved"),
    },
    "particle_em": {
        *("filtering.filtered", "smoothing.smoothed"),
        *("expecting.expected", "expecting.tracked", "maximising.maximised"),
    },
}
BRAKE = """
import json, sys
from importlib import import_module
from pkgutil import iter_modules
from adhesion_node.core import Config, Measurement, finish, init, step
from adhesion_node.core.estimator import warm_up
from adhesion_node.core.methods import kernels
modules = [import_module(f"{kernels.__name__}.{each.name}") for each in iter_modules(kernels.__path__)]
config = Config(method=sys.argv[1], identify_noise=True, iterations=3)
def compiled():
    named = [(module.__name__.split(".")[-1], *item) for module in modules for item in vars(module).items()]
    kernels = [(f"{file}.{name}", each) for file, name, each in named if hasattr(each, "signatures") and name[0] != "_"]
    print(json.dumps({name: len(each.signatures) for name, each in kernels if each.signatures}))
warm_up(config)
compiled()
for radar in (False, True):
    state, place, speed = init(config, 1), 0.0, 80.0
    for k in range(110):
        braked, seen = k > 20, place + 0.3 * (k % 3 - 1) + 5.0 * (k > 70)
        pressure, told = 410e3 if braked else 0.0, speed if radar and k % 2 else None
        state, _ = step(config, state, Measurement(k * 10**8, seen, 0.25, pressure, told))
        speed -= 0.07 * braked
        place += 0.1 * speed
    finish(config, state)
compiled()
"""

CASES = {
    "level": _case(LEVEL, FULL, 4.0),
    "profile and rotating mass": _case(SLOPED, FULL, 0.0),
    "building up": _case(SLOPED, TIMID, 4.0),
    "constant adhesion": _case(LEVEL, TIMID, 1.0, SpeedLaw(0.08)),
}


@pytest.mark.parametrize("margin", [0.0, 0.3, -math.inf])
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_normal_equation(case: tuple[Problem, Array], margin: float) -> None:
    problem, near = case
    weights = problem.model.weights(problem.squared(near))
    ours, theirs = problem.solved(near, 0.9, weights, margin), by_numpy.equation(problem, near, 0.9, weights, margin)
    steps, inverse = by_numpy.linearised(problem, near, 0.9), np.linalg.inv(theirs.matrix)
    np.testing.assert_allclose(
        ours.steps[:, :6], steps.moving.transpose(2, 0, 1).reshape(-1, 6), rtol=1e-12, atol=1e-13
    )
    np.testing.assert_allclose(ours.steps[:, equation.HEADROOM], steps.headroom, rtol=1e-12)
    np.testing.assert_allclose([*ours.moved, ours.change], theirs.step, rtol=1e-9, atol=1e-11)
    assert ours.information == pytest.approx(1.0 / inverse[-1, -1], rel=1e-10)
    assert ours.decrease == pytest.approx(0.5 * theirs.right @ theirs.step, rel=1e-10)
    assert ours.misfit == pytest.approx(theirs.misfit, rel=1e-11)
    np.testing.assert_allclose(equation.covariance_at_end(ours), inverse[-3:, -3:], rtol=1e-9, atol=1e-14)
    np.testing.assert_allclose(equation.position_variances(ours), np.diag(inverse)[:-1:2], rtol=1e-9)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_smoothed_window_and_what_it_leaves(case: tuple[Problem, Array]) -> None:
    problem, near = case
    search = KappaSearch(0.5, 0.0, 1e-9, 50)
    ours, theirs = smooth(problem, search, near), by_numpy.smoothed(problem, search, near)
    assert (ours.iterations, ours.converged) == (theirs.iterations, theirs.converged)
    for name in ("trajectory", "kappa", "weights", "headroom"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=1e-9, atol=1e-9)
    for margin in (0.0, -math.inf):
        left, expected = posterior(problem, ours, margin), by_numpy.posterior(problem, ours, margin)
        np.testing.assert_allclose(left.belief.mean, expected.belief.mean, rtol=1e-12)
        np.testing.assert_allclose(left.belief.covariance, expected.belief.covariance, rtol=1e-8, atol=1e-14)
        assert left.log_evidence == pytest.approx(expected.log_evidence, abs=1e-8)


@pytest.mark.parametrize("of_rail", [True, False])
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_jump_at_each_candidate(case: tuple[Problem, Array], of_rail: bool) -> None:
    problem, near = case
    weights = problem.model.weights(problem.squared(near))
    found = Smoothed(near, 0.9, weights, np.zeros(40), 0, True)
    now, candidates = problem.solved(near, 0.9, weights), np.arange(3, 38, dtype=np.intp)
    off = problem.window.position_m - near[1:, 0]
    parts = (
        jumps.of_kappa(now, problem.certainty)
        if of_rail
        else jumps.of_positions(weights / problem.window.variance_m2, off)
    )
    ours = jumps.tried(now, parts, candidates, 0.6, False)
    falls = jumps.tried(now, parts, candidates, 0.6, True)
    for c, first in enumerate(candidates):
        step, odds, variance = by_numpy.tried(problem, found, int(first), 0.6, of_rail=of_rail)
        assert ours.sizes[c] == pytest.approx(step[-1], rel=1e-9, abs=1e-11)
        assert 1.0 / ours.information[c] == pytest.approx(variance, rel=1e-9)
        assert ours.odds[c] == pytest.approx(odds, rel=1e-9, abs=1e-9)
        moved = jumps.moved(now, parts, int(first), float(step[-1]))
        np.testing.assert_allclose(moved, step[:-2], rtol=1e-8, atol=1e-10)
        end = [*moved[-2:] - now.moved[-2:], step[-2] - now.change]
        np.testing.assert_allclose(ours.per_jump[:, c] * step[-1], end, rtol=1e-7, atol=1e-10)
        hidden = step[-1] > 0.0 and now.steps[first, equation.HEADROOM] <= 0.0
        assert falls.odds[c] == (-np.inf if hidden else ours.odds[c])


def test_refuses_what_is_not_positive_definite() -> None:
    """A measurement of negative information."""
    problem, near = CASES["level"]
    with pytest.raises(np.linalg.LinAlgError, match=r"the window's system is not positive definite at 15 of 82"):
        problem.solved(near, 0.9, np.where(np.arange(40) == 6, -1e9, 1.0))
    wrong = replace(problem, prior=PRIOR._replace(covariance=-PRIOR.covariance))
    with pytest.raises(np.linalg.LinAlgError, match=r"the prior's covariance"):
        wrong.solved(near, 0.9, np.ones(40))


@pytest.mark.parametrize("method", OF)
def test_all_is_compiled_before_a_train_brakes(method: str) -> None:
    """The kernels of the configured method alone; a braking in which positions step compiles nothing more."""
    done = subprocess.run([sys.executable, "-c", BRAKE, method], capture_output=True, text=True, check=True)
    warm, braked = (json.loads(line) for line in done.stdout.splitlines())
    assert warm == braked
    assert set(warm) - {"filtering.systematic", "expecting.reduced"} == OF[method]  # those are called by others
    assert set(warm.values()) <= {1}

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A method is a value: a further one takes part as it is, and a window that loses the train begins anew."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest
from oracles import ride

from adhesion_node.core import Config, Estimate, Regime, finish, init, step
from adhesion_node.core.bank import BANK, SUMMARY
from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.belief.window import WindowSample
from adhesion_node.core.methods import METHODS
from adhesion_node.core.methods.protocol import Context, Fit, Verdict
from adhesion_node.core.setting import settings_of

BRAKING = ride([(4.0, 0.0), (12.0, 410e3)])


class Pair(NamedTuple):
    """A window of its own kind."""

    samples: tuple[WindowSample, ...]
    replaces: int = 0


@dataclass(frozen=True)
class Toy:
    """Says 0.07 of every rail, and a speed that is wrong by `off_mps`."""

    off_mps: float = 0.0
    summary: str = "always the same"

    def open(self, prior: Gaussian, sample: WindowSample, replaced: Pair | None = None) -> Pair:
        return Pair((sample,), 0 if replaced is None else replaced.replaces + 1)

    def extend(self, window: Pair, sample: WindowSample) -> Pair:
        return Pair((*window.samples, sample)[-10:], window.replaces)

    def evaluate(self, config: Config, window: Pair, context: Context) -> Verdict:
        first, last = window.samples[0], window.samples[-1]
        speed = (last.position_m - first.position_m) / (last.t_ns - first.t_ns) * 1e9 + self.off_mps
        belief = Gaussian(np.array([last.position_m, speed]), np.diag([0.25, 0.3]))
        rail = Rail(0.07, 0.001, 0.068)
        return Verdict(Regime.ADHESION_LIMITED, rail, belief, window, mu=0.07, fit=Fit(len(window.samples), 1))


def _estimates(toy: Toy, config: Config) -> tuple[list[Estimate], int]:
    """Those with a window, and how often a window began anew."""
    state, estimates, anew = init(config, 1)._replace(method=toy), list[Estimate](), 0
    for measurement in BRAKING:
        state, estimate = step(config, state, measurement)
        estimates += [] if estimate is None else [estimate]
        anew = state.window.replaces if isinstance(state.window, Pair) else anew
    return [*estimates, *finish(config, state)[1]], anew


def test_a_further_method_runs_through_step() -> None:
    estimates, anew = _estimates(Toy(), Config())
    braked = [estimate for estimate in estimates if estimate.window]
    assert len(braked) > 20
    assert {(e.mu, e.mu_lower, e.regime, e.iterations) for e in braked} == {(0.07, 0.068, Regime.ADHESION_LIMITED, 1)}
    assert anew == 0


def test_a_window_that_has_lost_the_train_begins_anew_at_the_tracker() -> None:
    """Not at once, for behind a step of the positions it is the tracker that is off."""
    config = Config(restart_s=2.0)
    estimates, anew = _estimates(Toy(off_mps=9.0), config)
    at_s = [e.t_ns * 1e-9 for e in estimates if e.window]
    again_s = [e.t_ns * 1e-9 for e in estimates if not e.window and e.t_ns * 1e-9 > at_s[0]]
    assert anew == len(again_s) >= 3
    assert again_s[0] - at_s[0] == pytest.approx(2.0, abs=0.6)
    restarted = next(e for e in estimates if e.t_ns * 1e-9 == again_s[0])
    assert (restarted.regime, restarted.mu_std) == (Regime.COASTING, config.unknown_std)
    assert restarted.speed_mps == pytest.approx(80.0 - 0.75 * (again_s[0] - 4.0), abs=3.0)
    assert _estimates(Toy(off_mps=9.0), Config(restart_sigma=1e6))[1] == 0


def test_the_setting_offers_and_describes_the_methods_of_the_registry() -> None:
    method = next(setting for setting in settings_of(Config) if setting.name == "method")
    assert method.choices == (BANK, *METHODS)
    assert f"{BANK}: {SUMMARY}" in method.description
    assert init(Config(method=BANK), 1).method is None
    assert all(f"{name}: {value.summary}" in method.description for name, value in METHODS.items())
    for name in METHODS:
        assert init(Config(method=name), 1).method is METHODS[name]
    with pytest.raises(ValueError, match=r"method = 'toy': choose one of bank, rail_condition, particle_em"):
        Config(method="toy")

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the faults of the sensors cost: each faulty run beside the same run without the fault."""

from __future__ import annotations

import numpy as np
import pytest
from faulty import S, assert_sound, outcome

from adhesion_node.core import Config

SEEDS = (1, 2, 3, 4)
"""One run alone is too often lucky."""

TWO_SIDED_90 = 1.644854
"""Quantile of the standard normal law."""


@pytest.mark.parametrize("duration_s", [1.0, 5.0, 30.0])
def test_a_dropout_costs_certainty_and_is_made_up_within_a_window(duration_s: float) -> None:
    gap, whole = outcome("dropout", start_s=35.0, duration_s=duration_s), outcome("none").by_second()
    after = [p.estimate for p in gap.predictions if p.estimate.t_ns > (35.0 + duration_s) * S]
    first = after[0]
    if duration_s > Config().max_gap_s:  # a shorter one is bridged: the window only spans more time
        assert first.mu_std > whole[first.t_ns // S].mu_std
        assert first.position_std_m > whole[first.t_ns // S].position_std_m
    made_up = [e for e in after if e.t_ns > (35.0 + duration_s + 6.0) * S]
    assert made_up
    for e in made_up:
        b = whole[e.t_ns // S]
        assert abs(e.mu - b.mu) < 3.0 * max(e.mu_std, b.mu_std)
    assert_sound(gap)


def test_a_bridged_dropout_leaves_position_and_speed_less_certain() -> None:
    """In the speed it shows on average only: which hypotheses are plausible weighs more."""
    speed = []
    for seed in (1, 2, 3):
        after = (p.estimate for p in outcome("dropout", seed, start_s=35.0, duration_s=1.0, knows_law=True).predictions)
        first = next(e for e in after if e.t_ns >= 36 * S)
        whole = outcome("none", seed, knows_law=True).predictions
        b = min((p.estimate for p in whole), key=lambda e: abs(e.t_ns - first.t_ns))
        assert first.position_std_m > 1.1 * b.position_std_m
        speed.append(first.speed_std_mps / b.speed_std_mps)
    assert np.mean(speed) > 1.03


def test_30_percent_of_loss_stays_within_3_sigma() -> None:
    lossy, whole = outcome("loss"), outcome("none").by_second()
    for e in lossy.braking():
        b = whole[e.t_ns // S]
        assert abs(e.mu - b.mu) < 3.0 * max(e.mu_std, b.mu_std)
    assert_sound(lossy)


def test_at_changing_rates_the_90_percent_interval_covers_at_least_85() -> None:
    """It covers more: it allows for laws that are not true, and for a grade that the profile leaves open."""
    runs = [outcome("irregular", seed, knows_track=True) for seed in SEEDS]
    stds = np.concatenate([[e.mu_std for e in run.braking()] for run in runs])
    within = np.abs(np.concatenate([run.errors() for run in runs])) <= TWO_SIDED_90 * stds
    assert np.mean(within) >= 0.85
    for run in runs:
        assert_sound(run)


def mean_error(fault: str) -> float:
    return float(np.mean([np.abs(outcome(fault, seed).errors()).mean() for seed in SEEDS]))


@pytest.mark.parametrize("fault", ["outliers", "burst", "heavy_tails"])
def test_outliers_cost_at_most_half_as_much_again(fault: str) -> None:
    assert mean_error(fault) <= 1.5 * mean_error("none")
    assert_sound(outcome(fault))


def test_outliers_are_flagged() -> None:
    assert outcome("outliers").pipeline.dropped["OUTLIER"] >= 20


@pytest.mark.parametrize(("fault", "shift"), [("grade", -0.005), ("mass", 0.0)])
def test_an_unknown_grade_or_mass_shifts_mu_by_what_it_must(fault: str, shift: float) -> None:
    """Downhill 5 permille takes 0.005 off; the mass cancels for as long as the rail limits, and is known to."""
    faulty, clean = ({e.t_ns: e.mu for e in outcome(each, knows_law=True).braking()} for each in (fault, "none"))
    shifts = [faulty[t_ns] - clean[t_ns] for t_ns in faulty.keys() & clean.keys()]
    assert len(shifts) > 50
    assert np.mean(shifts) == pytest.approx(shift, abs=0.001)


def test_a_balise_step_is_not_taken_for_low_adhesion() -> None:
    step, whole = outcome("balise_step", start_s=45.0), outcome("none")
    same_time = {p.estimate.t_ns: p.estimate for p in whole.predictions}
    for p in step.predictions:
        b = same_time.get(p.estimate.t_ns)
        if p.estimate.t_ns > 45 * S and b is not None:
            assert p.estimate.mu - b.mu > -3.0 * max(b.mu_std, p.estimate.mu_std)
            assert p.estimate.mu_lower <= step.true(p.estimate.t_ns).mu

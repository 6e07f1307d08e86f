# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Braking curves of a run: thinned while they are read, their distances kept."""

from __future__ import annotations

import numpy as np
import pytest

from adhesion_node.report.read import predicted
from adhesion_node.report.read.predicted import Curves, distances_to

SPEEDS = np.array([40.0, 30.0, 20.0, 0.0])


def add(curves: Curves, *t_ns: int) -> None:
    """Add curves from 40 m/s to a standstill within as many metres as their stamps have nanoseconds."""
    stamps = np.array(t_ns)
    curves.add(stamps, 1e6 + stamps[:, np.newaxis] * (1.0 - SPEEDS / 40.0), np.tile(SPEEDS, (stamps.size, 1)))


def test_a_long_run_keeps_curves_of_all_of_it_and_every_distance(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(predicted, "MOST_CURVES", 8)
    curves = Curves(targets=(0.0, 20.0))
    for t_ns in range(1, 101, 20):
        add(curves, *range(t_ns, t_ns + 20))
        assert len(curves.kept) <= 8
    kept = [each.t_ns for each in curves.kept]
    assert kept[0] == 1
    assert kept[-1] > 80
    assert set(np.diff(kept)) == {16}
    assert curves.lengths(0.0).values == pytest.approx(np.arange(1.0, 101.0))
    assert curves.lengths(20.0).values == pytest.approx(np.arange(1.0, 101.0) / 2.0)
    other = curves.lengths(30.0)
    assert other.t_ns.tolist() == kept
    assert other.values == pytest.approx(np.array(kept) / 4.0)


def test_a_short_run_keeps_all_of_them_in_the_order_of_their_stamps() -> None:
    curves = Curves()
    for t_ns in (3, 1, 2):
        add(curves, t_ns)
    assert [each.t_ns for each in curves.kept] == [1, 2, 3]
    assert curves.lengths(50.0).t_ns.tolist() == [1, 2, 3]
    assert curves.lengths(50.0).values.tolist() == [0.0] * 3


@pytest.mark.parametrize("target", [0.0, 5.0, 20.0, 39.9, 40.0, 60.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_distance_is_that_of_an_interpolation_over_the_speed(target: float, sign: int) -> None:
    rng = np.random.default_rng(1)
    speeds = -np.sort(-rng.uniform(3.0, 50.0, (20, 30)), axis=1)
    places = 1e4 + sign * np.cumsum(rng.uniform(0.0, 9.0, (20, 30)), axis=1)
    expected = [abs(np.interp(-target, -v, x) - x[0]) for v, x in zip(speeds, places, strict=True)]
    assert distances_to(target, places, speeds) == pytest.approx(np.array(expected))

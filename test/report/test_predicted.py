# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Braking curves of a run: thinned while they are read, their distances kept."""

from __future__ import annotations

import numpy as np
import pytest

from adhesion_node.report import predicted
from adhesion_node.report.predicted import Curve, Curves


def curve(t_ns: int) -> Curve:
    """From 40 m/s to a standstill within as many metres as its stamp has nanoseconds, at v^2 over the way."""
    speeds = np.array([40.0, 30.0, 20.0, 0.0])
    return Curve(t_ns, 1e6 + t_ns * (1.0 - speeds / 40.0), speeds)


def test_a_long_run_keeps_curves_of_all_of_it_and_every_distance(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(predicted, "MOST_CURVES", 8)
    curves = Curves(targets=(0.0, 20.0))
    for t_ns in range(1, 101):
        curves.add(curve(t_ns))
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
        curves.add(curve(t_ns))
    assert [each.t_ns for each in curves.kept] == [3, 1, 2]
    assert curves.lengths(50.0).t_ns.tolist() == [1, 2, 3]
    assert curves.lengths(50.0).values.tolist() == [0.0] * 3

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The figures of the studies: their formats, letters that stay texts, the same line once, a row for each case."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from adhesion_node.study.robust.study import _draw
from adhesion_node.study.trial.drawing import PAGE_IN, draw_cases, draw_lines, picture
from adhesion_node.study.trial.figures import Figures


def test_what_is_the_same_is_drawn_once_under_both_names(tmp_path: Path) -> None:
    x = np.arange(3.0)
    with picture(tmp_path / "lines.svg", "title") as axis:
        draw_lines(axis, x, {"one": x, "two": x**2, "three": x.copy()})
        assert [line.get_label() for line in axis.get_lines()] == ["one, three", "two"]
        assert axis.figure.get_size_inches()[0] == PAGE_IN


def test_a_row_for_each_case_and_none_for_what_is_not_known(tmp_path: Path) -> None:
    draw_cases(tmp_path / "cases.svg", "N = 3", "%", ["first", "second"], {"mean": [1.0, None]})
    drawn = (tmp_path / "cases.svg").read_text(encoding="utf-8")
    assert all(text in drawn for text in ("first", "second", "N = 3", "mean"))


def test_a_table_of_study_robust_is_drawn(tmp_path: Path) -> None:
    errors = ("mean_relative_error_percent", "p5_relative_error_percent", "p95_relative_error_percent")
    row = {"case": "snow", "runs": 7, "lower_bound_holds": 0.97, **dict.fromkeys(errors, 1.0)}
    _draw("rails", [row], Figures(tmp_path / "new", "svg"))
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["rails_bound.svg", "rails_error.svg"]
    assert "N = 7 runs of each case" in (tmp_path / "new" / "rails_error.svg").read_text(encoding="utf-8")

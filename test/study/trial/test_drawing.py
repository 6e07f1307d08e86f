# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The figures of the studies: their formats, letters that stay texts, the same line once, a row for each case."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from adhesion_node.study.robust.study import _draw
from adhesion_node.study.trial.drawing import DOTS_PER_INCH, draw_cases, draw_lines, picture
from adhesion_node.study.trial.figures import COLUMN_MM, FORMATS, PAGE_MM, Figures, Place

POINTS_PER_INCH = 72.0


def test_what_is_the_same_is_drawn_once_under_both_names(tmp_path: Path) -> None:
    x = np.arange(3.0)
    with picture(Place(tmp_path / "lines.svg"), "title") as axis:
        draw_lines(axis, x, {"one": x, "two": x**2, "three": x.copy()})
        assert [line.get_label() for line in axis.get_lines()] == ["one, three", "two"]


@pytest.mark.parametrize("width_mm", [COLUMN_MM, PAGE_MM])
@pytest.mark.parametrize("ending", FORMATS)
def test_a_figure_is_as_wide_as_the_column_of_a_journal(ending: str, width_mm: int, tmp_path: Path) -> None:
    place = Figures(tmp_path / "new", ending, width_mm).place("figure")
    title = "What a long title says of N = 200 runs of a case, from each of some starts: it is folded"
    with picture(place, title) as axis:
        axis.plot([0.0, 1.0])
        (told,) = [text for text in axis.figure.texts if text.get_text().startswith("What")]
        axis.figure.canvas.draw()
        assert told.get_window_extent().width <= axis.figure.bbox.width
        assert told.get_fontsize() >= 8.0
    if ending == "png":
        inches = imread(place.path).shape[1] / DOTS_PER_INCH
    else:
        found = re.search(rb'(?:width="|/MediaBox \[ ?0 0 )([\d.]+)', place.path.read_bytes())
        assert found is not None
        inches = float(found[1]) / POINTS_PER_INCH
    assert 25.4 * inches == pytest.approx(width_mm, abs=0.5)


def test_a_row_for_each_case_and_none_for_what_is_not_known(tmp_path: Path) -> None:
    draw_cases(Place(tmp_path / "cases.svg"), "N = 3", "%", ["first_one", "second"], {"mean": [1.0, None]})
    drawn = (tmp_path / "cases.svg").read_text(encoding="utf-8")
    assert all(text in drawn for text in ("first one", "second", "N = 3", "mean"))


def test_a_table_of_study_robust_is_drawn(tmp_path: Path) -> None:
    errors = ("mean_relative_error_percent", "p5_relative_error_percent", "p95_relative_error_percent")
    row = {"case": "snow", "runs": 7, "lower_bound_holds": 0.97, **dict.fromkeys(errors, 1.0)}
    _draw("rails", [row], Figures(tmp_path / "new", "svg"))
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["rails_bound.svg", "rails_error.svg"]
    assert "N = 7 runs of each case" in (tmp_path / "new" / "rails_error.svg").read_text(encoding="utf-8")

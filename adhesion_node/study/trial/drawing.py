# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The style of all figures of the studies, in the columns of a journal: told apart without colour."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from ...command.written import naming
from ...core.physics.train import Array
from ...report.drawn.picture import BLACK, BLUE, GREY, ORANGE
from .figures import Place

STYLES = ((BLACK, "-"), (BLUE, "--"), (ORANGE, "-."), (GREY, ":"), ("#5b8c2a", (0, (5, 1, 1, 1, 1, 1))))
"""Colour and dashes of the lines of a picture."""

INCH_MM = 25.4
TITLE_PER_IN = 15
"""Letters of a title that stand on an inch."""

LETTERS: Any = {"font.size": 8.0, "svg.fonttype": "none", "pdf.fonttype": 42}
"""Height of the letters, points; texts stay texts."""

DOTS_PER_INCH = 200

NAMES = {
    "bank": "bank, the default",
    "rail_condition": "rail condition",
    "particle_em": "the paper's method",
    "ekf_tuned": "extended Kalman filter, tuned",
    "ekf_naive": "extended Kalman filter, naive",
}
"""Methods as a reader knows them."""


@contextmanager
def panels(place: Place, title: str, count: int, height: float = 3.2) -> Iterator[list[Any]]:
    """Give the axes of a picture of `count` panels of a height, inches; it is written when the block is done."""
    width = place.width_mm / INCH_MM
    with rc_context(LETTERS):
        figure = Figure(figsize=(width, height * count + 0.4), layout="constrained")
        figure.suptitle(fill(title, int(TITLE_PER_IN * width)))
        axes = list(figure.subplots(count, squeeze=False)[:, 0])
        for axis in axes:
            axis.grid(alpha=0.3)
        yield axes
        with naming(place.path):
            figure.savefig(place.path, dpi=DOTS_PER_INCH)


@contextmanager
def picture(place: Place, title: str, height: float = 3.2) -> Iterator[Any]:
    """Give the axis of a picture of one panel."""
    with panels(place, title, 1, height) as (axis,):
        yield axis


def draw_lines(axis: Any, x: Array, lines: Mapping[str, Array]) -> None:
    """Draw lines, by label, over the same `x`; those that are the same are drawn once."""
    drawn: dict[bytes, list[str]] = {}
    for label, values in lines.items():
        drawn.setdefault(np.asarray(values).tobytes(), []).append(label)
    for (color, dashes), labels in zip(STYLES, drawn.values(), strict=False):
        axis.plot(x, lines[labels[0]], color=color, ls=dashes, lw=1.4, label=", ".join(labels))


def draw_cases(
    place: Place, title: str, unit: str, names: Sequence[str], columns: Mapping[str, Sequence[float | None]]
) -> None:
    """Draw a row of marks for each case, one mark for each column; None is left out."""
    height, rows = 0.17 * len(names) + 0.9, np.arange(len(names))
    with picture(place, title, height) as axis:
        for (color, _), marker, (label, values) in zip(STYLES, "osx^v", columns.items(), strict=False):
            known = np.array([np.nan if value is None else value for value in values], dtype=float)
            axis.plot(known, rows, color=color, marker=marker, ms=4, ls="", label=label)
        axis.set_yticks(rows, [name.replace("_", " ") for name in names])
        axis.set(xlabel=unit, ylim=(len(names) - 0.5, -0.5))
        axis.legend(loc="best")

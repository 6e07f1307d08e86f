# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The style of all figures of the studies: told apart without colour."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from ...core.physics.train import Array
from ...report.picture import BLACK, BLUE, GREY, ORANGE

STYLES = ((BLACK, "-"), (BLUE, "--"), (ORANGE, "-."), (GREY, ":"), ("#5b8c2a", (0, (5, 1, 1, 1, 1, 1))))
"""Colour and dashes of the lines of a picture."""


@contextmanager
def panels(path: Path, title: str, count: int, size: tuple[float, float] = (8.0, 4.0)) -> Iterator[list[Any]]:
    """Give the axes of a picture of `count` panels of a size, inches; it is written when the block is done."""
    width, height = size
    figure = Figure(figsize=(width, height * count + 0.5), layout="constrained")
    figure.suptitle(title)
    axes = list(figure.subplots(count, squeeze=False)[:, 0])
    for axis in axes:
        axis.grid(alpha=0.3)
    yield axes
    figure.savefig(path, dpi=110)


@contextmanager
def picture(path: Path, title: str, size: tuple[float, float] = (8.0, 4.0)) -> Iterator[Any]:
    """Give the axis of a picture of one panel."""
    with panels(path, title, 1, size) as (axis,):
        yield axis


def draw_lines(axis: Any, x: Array, lines: Mapping[str, Array]) -> None:
    """Draw lines, by label, over the same `x`."""
    for (color, dashes), (label, values) in zip(STYLES, lines.items(), strict=False):
        axis.plot(x, values, color=color, ls=dashes, lw=1.8, label=label)

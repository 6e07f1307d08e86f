# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The style of all figures of the studies: told apart without colour."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

STYLES = (("0.0", "-"), ("#0b5fa5", "--"), ("#c75b00", "-."), ("0.45", ":"), ("#5b8c2a", (0, (5, 1, 1, 1, 1, 1))))
"""Colour and dashes of the lines of a picture."""


@contextmanager
def panels(path: Path, title: str, count: int) -> Iterator[list[Any]]:
    """Give the axes of a picture of `count` panels, one above the other; it is written when the block is done."""
    figure = Figure(figsize=(8, 4 * count + 0.5), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    axes = list(figure.subplots(count, squeeze=False)[:, 0])
    for axis in axes:
        axis.grid(alpha=0.3)
    yield axes
    figure.savefig(path, dpi=110)


@contextmanager
def picture(path: Path, title: str) -> Iterator[Any]:
    """Give the axis of a picture of one panel."""
    with panels(path, title, 1) as (axis,):
        yield axis

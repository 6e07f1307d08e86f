"""Gaussian update of one window, EM converged: ours as one banded system beside an RTS loop of `filterpy`."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .scene import braking_window
from .timing import Contender, figures, interleave

PEER = "filterpy, RTS loop"

START_MU = 0.05
ITERATIONS, TOLERANCE = 50, 1e-7


def compare(steps: int, rounds: int, seed: int) -> list[dict[str, Any]]:
    """Rows of the table for a window of so many steps."""
    from . import filterpy_smoother  # the peer is an extra

    motion, prior, window = braking_window(steps, np.random.default_rng(seed))
    em = partial(filterpy_smoother.em, motion, prior, window, START_MU, ITERATIONS, TOLERANCE)
    timed = interleave([Contender(PEER, em, rounds)])
    return [
        {"method": name, **figures(runs.seconds), "mu": runs.results[0].mu, "iterations": runs.results[0].iterations}
        for name, runs in timed.items()
    ]

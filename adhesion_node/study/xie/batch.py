# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The EM of many runs at once, as `core.em` has it for one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.methods.particle_em.em import Identified, Search
from ...core.physics.motion import Motion
from ...core.physics.train import Array
from .batch_particles import Windows, draw
from .batch_smoother import Expectations, Room, expectations


def maximise(expected: Expectations, lowest: Array) -> Array:
    """M-step `core.em.maximise` of every run; `lowest` has shape (R,)."""
    order = np.argsort(expected.limit, axis=1)
    used, weight, limit = (np.take_along_axis(column, order, axis=1) for column in expected[:3])
    active_weight = np.cumsum(weight[:, ::-1], axis=1)[:, ::-1]
    active_moment = np.cumsum((weight * used)[:, ::-1], axis=1)[:, ::-1]
    least = lowest[:, None]
    bottoms = np.maximum(np.concatenate((least, limit[:, :-1]), axis=1), least)
    candidates = np.clip(active_moment / active_weight, bottoms, np.maximum(limit, least))
    if np.all(limit[:, 0] == limit[:, -1]):  # one parabola up to the common limit
        return np.asarray(candidates[:, 0])
    deviation = np.minimum(candidates[:, :, None], limit[:, None, :]) - used[:, None, :]
    best = np.argmax(-np.sum(weight[:, None, :] * deviation**2, axis=2), axis=1)
    return np.take_along_axis(candidates, best[:, None], axis=1)[:, 0]


def identify(
    motion: Motion,
    windows: Windows,
    searches: Sequence[Search],
    count: int,
    rngs: Sequence[np.random.Generator],
) -> list[Identified]:
    """`core.em.identify` of every run with `count` particles."""
    found: dict[int, Identified] = {}
    mu = np.array([search.start for search in searches])
    iterations, tolerance, lowest = (np.array(column) for column in list(zip(*searches, strict=True))[1:])
    going, done = np.arange(len(searches)), 0
    some, room = windows, Room.of(going.size, len(windows.dt_s), count)
    while going.size:
        if going.size < len(some.mean):
            some, room = windows.of(going), Room.of(going.size, len(windows.dt_s), count)
        draw([rngs[int(run)] for run in going], room.draws)
        expected = expectations(motion, some, mu[going], room)
        previous, mu[going] = mu[going], maximise(expected, lowest[going])
        top = expected.limit.max(axis=1)
        inside = (lowest[going] < mu[going]) & (mu[going] < top)
        moved = np.where(inside, np.abs(mu[going] - previous), np.inf)
        done += 1
        ended = (moved <= tolerance[going]) | (done >= iterations[going])
        for i in np.flatnonzero(ended):
            run = int(going[i])
            found[run] = Identified(
                mu=float(mu[run]),
                iterations=done,
                converged=bool(moved[i] <= tolerance[run]),
                weight=float(np.sum(expected.weight[i][expected.limit[i] >= mu[run]])),
                limit=float(top[i]),
                log_likelihood=float(expected.log_likelihood[i]),
                ess=float(expected.ess[i]),
            )
        going = going[~ended]
    return [found[run] for run in range(len(searches))]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Timing side by side: after a warm-up the contenders take turns, so that whatever else the machine does hits all."""

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from ..command.options import progress

Result = TypeVar("Result")

SLOW = 10
"""A slow contender takes part in every so many rounds."""


class Contender(NamedTuple, Generic[Result]):
    """Something to time: `run` is called in so many rounds, spread over all of them."""

    name: str
    run: Callable[[], Result]
    rounds: int


class Timed(NamedTuple, Generic[Result]):
    """What the calls of a contender took of the processor, s, and returned."""

    seconds: list[float]
    results: list[Result]


def interleave(contenders: Sequence[Contender[Result]]) -> dict[str, Timed[Result]]:
    """Call every contender once to warm up, then in turns; the results by name."""
    for contender in contenders:
        contender.run()
    timed: dict[str, Timed[Result]] = {contender.name: Timed([], []) for contender in contenders}
    rounds = max(contender.rounds for contender in contenders)
    for turn in progress(range(rounds), "rounds", rounds):
        for name, run, wanted in contenders:
            if turn * wanted % rounds < wanted:
                started = time.process_time()
                result = run()
                timed[name].seconds.append(time.process_time() - started)
                timed[name].results.append(result)
    return timed


def beside(timed: Timed[Result], ours: Timed[Result]) -> dict[str, Any]:
    """`figures` of a contender, and the ratio of its median to ours."""
    return {**figures(timed.seconds), "ratio": float(np.median(timed.seconds) / np.median(ours.seconds))}


def figures(seconds: Iterable[float]) -> dict[str, Any]:
    """Number, median, 99th percentile and maximum, in ms."""
    ms = 1e3 * np.array(list(seconds))
    p50, p99 = np.percentile(ms, (50, 99))
    return {"calls": ms.size, "median_ms": float(p50), "p99_ms": float(p99), "max_ms": float(ms.max())}

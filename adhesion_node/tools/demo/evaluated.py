# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What comes of a demo: its recording replayed offline, when it was told what limits, and all that in words."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from shlex import join
from typing import Any

import numpy as np

from ...bag import BagReader, select
from ...core import Regime
from ...report.found.regimes import Band
from ...report.read.gathered import read_status
from ...report.read.run import Run
from ...run import offline
from ...run.pipeline import Pipeline
from ...run.results.score import Truth
from ...wire.settings.setup import setup_of
from ...wire.topics import ATP_STATUS
from .line import Task


def evaluate(reader: BagReader, task: Task) -> dict[str, Any]:
    """Replay the demo's own recording offline, and sum up what the ATP monitor said."""
    selection = select(reader.topics)
    setup, truth = setup_of(task.estimator), Truth()
    pipeline = Pipeline(setup.config, task.seed)
    replayed = offline.replay(pipeline, truth, offline.messages(reader, selection, setup.line), setup.line)
    levels = read_status(reader, ATP_STATUS, "level").values.tolist()
    changes = [level for previous, level in pairwise(["", *levels]) if level != previous]
    estimates = [made.estimate for made in replayed.predictions]
    return {**offline.summary(pipeline, replayed.window_ms, truth, estimates), "atp": " > ".join(changes)}


def true_bands(regimes: Sequence[tuple[int, str]], run: Run) -> list[Band]:
    """The true regimes over the time of the run."""
    ends = [*(t_ns for t_ns, _ in regimes[1:]), int(run.true_speed.t_ns[-1])]
    times = run.seconds(np.array([[t_ns for t_ns, _ in regimes], ends])).T
    return [Band(start_s, end_s, regime) for (start_s, end_s), (_, regime) in zip(times.tolist(), regimes, strict=True)]


def found(truth: Sequence[Band], run: Run) -> dict[str, float]:
    """When adhesion first limited the train, s, and how long after that an estimate says so."""
    limited = Regime.ADHESION_LIMITED.name
    begun_s = next((band.start_s for band in truth if band.regime == limited), math.inf)
    said_s = run.seconds(run.regime.t_ns[run.regime.values == limited])
    said_s = said_s[said_s >= begun_s]
    return {"limited_from_s": begun_s, "told_after_s": float(said_s[0]) - begun_s} if said_s.size else {}


def said(result: dict[str, Any]) -> Iterator[str]:
    """The result in words."""
    if "mean_relative_error_percent" in result:
        yield f"mean relative error while adhesion limits: {result['mean_relative_error_percent']:.2f} %"
    if "told_after_s" in result:
        yield f"adhesion limits from {result['limited_from_s']:.1f} s on, told {result['told_after_s']:.1f} s later"
    if "ms_per_window_p50" in result:
        yield f"an estimate takes {result['ms_per_window_p50']:.1f} ms (median of {result['windows']})"
    same = "gives the same numbers to the last bit" if result["live_equals_offline"] else "GIVES OTHER NUMBERS"
    yield f"an offline replay of the recording {same} (digest {result['digest'][:16]}...):"
    yield f"  {join(['replay', result['bag'], '--offline', '--params', result['params']])}"
    yield f"ATP monitor: {result['atp']}"
    yield f"recording: {result['bag']}    picture: {result['picture']}    ({result['seconds']} s)"

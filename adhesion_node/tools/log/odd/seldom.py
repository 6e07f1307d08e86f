# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Pressures that are written where they change alone: in between they count as unknown, not as what they were."""

from collections.abc import Iterator

import numpy as np

from ....core.config import Config
from ....core.physics.train import Array
from ..format import PRESSURES, option
from ..whole.read import Log

LEAST_SHARE = 0.2
"""Of the log's time in which a pressure is older than it counts."""


def seldom(log: Log, t_s: Array) -> Iterator[str]:
    """Say which pressures are written on a change alone, as no value of theirs is the one before."""
    oldest_s = Config().pressure_age_s
    for name in PRESSURES[:2]:
        known = log.rows[name].notna().to_numpy() if name in log.rows else np.zeros(len(t_s), dtype=np.bool_)
        values, at = log.rows.get(name, log.rows["t_ns"])[known].to_numpy(), np.append(t_s[known], t_s[-1])
        gaps_s = np.diff(at)
        unknown_s = (gaps_s - oldest_s).clip(0.0).sum()
        few = 0 < 2 * known.sum() < len(t_s)
        if few and unknown_s > LEAST_SHARE * t_s[-1] and (np.diff(values) != 0.0).all():
            theirs = name if name in log.columns.names else "brake_pipe"
            yield (
                f"{theirs} has a value in {known.sum()} of {len(t_s)} rows, each another than before, and none "
                f"for {gaps_s.max():.3g} s: is it written where it changes alone? After {oldest_s:g} s it is unknown: "
                f"--hold where it is as it was, or name another column with {option(theirs)} COL"
            )

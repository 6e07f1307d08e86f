# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The creep curve on a page: its curves as the slider moves, its peak in words, and why that was withheld."""

from collections.abc import Sequence
from typing import Any

from ..read.creep import CreepCurves
from .thinning import evenly, number

MOST_CURVES = 200
"""Curves of a run at most, evenly spread over its time."""


def creep_data(curves: CreepCurves, origin_ns: int) -> list[dict[str, Any]]:
    """What the script of the report draws; `t` in s from the start of the run."""
    kept = [curves[i] for i in evenly(len(curves), MOST_CURVES)]
    return [{"t": number((t_ns - origin_ns) * 1e-9, 2), **part} for t_ns, part in kept]


def creep_in_words(curves: Sequence[tuple[int, dict[str, Any]]]) -> str:
    """How often the peak was known, and the last of what was told."""
    if not curves:
        return "not recorded"
    known = [part for _, part in curves if not part["withheld"]]
    last = known[-1] if known else None
    text = f"known in {len(known)} of {len(curves)} estimates"
    if last is not None:
        text += f", last {last['peak'][1]:.3f} at a creep of {last['peak'][0]:.3f}"
    return text + (f"; at the end withheld: {curves[-1][1]['why']}" if curves[-1][1]["withheld"] else "")

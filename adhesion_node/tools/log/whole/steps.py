# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Columns that go by coarse steps, tens of metres or 5 km/h: none is known better than its step over root 12."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import pandas as pd

from ....core.config import Config
from ....core.physics.train import Array
from ....run.results.steps import step_of
from ....wire.line import Line
from ..format import Format

DEGREE_M = 111.2e3
"""Of latitude."""

ALONG_M = 0.5
"""Standard deviation of a position along the track of which nothing tells one."""

SHOWS = 0.25
"""Of the assumed standard deviation: what a step makes less of is not said."""


class Coarse(NamedTuple):
    """What is assumed of a quantity, whether the estimator itself does so, and what says otherwise."""

    columns: tuple[str, ...]
    std: float
    by_setting: bool
    told_by: str
    unit: str
    cure: str


QUANTITIES = {
    "position": Coarse(("position",), ALONG_M, False, "variance", "m", "--position-std"),
    "fix": Coarse(("lat", "lon"), Line().position_std_m, True, "variance", "m", "--position-std"),
    "speed": Coarse(("speed",), Config().speed_std_mps, True, "speed_std", "m/s", "--speed-std COL"),
}
"""By topic."""


def stds_of(rows: pd.DataFrame, form: Format) -> tuple[dict[str, float], list[str]]:
    """Return by topic the standard deviation where the log tells none, 0 where the estimator is to say, and notes."""
    stds, notes = {}, []
    for topic, known in QUANTITIES.items():
        stds[topic] = 0.0 if known.by_setting else known.std
        if form.position_std_m is not None and topic != "speed":
            stds[topic] = form.position_std_m
        elif set(known.columns) <= set(rows) and (known.told_by not in rows or rows[known.told_by].isna().any()):
            step = max(step_of(metres, SHOWS * math.sqrt(12.0) * known.std) for metres in metres(rows, known.columns))
            if step:
                least = step / math.sqrt(12.0)
                stds[topic] = least if least > known.std else stds[topic]
                notes.append(
                    f"{topic}: in steps of {step:.4g} {known.unit}, a standard deviation of {least:.3g} {known.unit} "
                    f"at least: {max(least, known.std):.3g} is taken; {known.cure} says otherwise"
                )
    return stds, notes


def metres(rows: pd.DataFrame, columns: Sequence[str]) -> Iterator[Array]:
    """The columns, and degrees as metres."""
    for name in columns:
        scale = {"lat": DEGREE_M, "lon": DEGREE_M * math.cos(math.radians(float(rows.get("lat", rows[name]).median())))}
        yield rows[name].to_numpy() * scale.get(name, 1.0)

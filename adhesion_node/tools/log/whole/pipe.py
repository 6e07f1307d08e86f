# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The demand that the pressure of the brake pipe is: so far below that at which the brake is released."""

from dataclasses import replace

import pandas as pd

from ..format import PRESSURE_UNITS, SHARES, Format
from .moving import moves

FULL_DROP_PA = 1.5e5
"""The pipe's pressure falls by so much for a full brake (UIC 540)."""

RELEASED_PA = 2e5, 1.2e6
"""What a pipe may have while the brake is released; mostly it is 5 bar."""


def demanded(rows: pd.DataFrame, form: Format) -> tuple[pd.DataFrame, Format, str]:
    """The rows with the demand that the pressure of the brake pipe is, and from where on it is released."""
    pipe, unit = rows["brake_pipe"] - form.ambient_pressure_pa, form.unit("brake_pipe")
    if unit in SHARES:
        raise ValueError(
            f"brake_pipe is said to be in {unit}: it falls for a brake, give its pressure; or --demand COL?"
        )
    scale = PRESSURE_UNITS[unit]
    released = pipe[moves(rows)].quantile(0.9) if form.pipe_released is None else form.pipe_released * scale
    if form.pipe_released is not None and not RELEASED_PA[0] <= released <= RELEASED_PA[1]:
        least, most = (pa / scale for pa in RELEASED_PA)
        range_ = f"give what the pipe has while the brake is released, {least:g} to {most:g} {unit}"
        raise ValueError(f"pipe-released = {form.pipe_released:g} {unit}: {range_}; mostly it is {5e5 / scale:g}")
    if pd.isna(released):
        note = (
            "brake pipe: no value while the train runs, so what is demanded is unknown: --pipe-released, or --pipe COL"
        )
        return rows.drop(columns="brake_pipe").assign(brake_demand=float("nan")), form, note
    share = ((released - pipe) / FULL_DROP_PA).clip(0.0, 1.0)
    rows = rows.drop(columns="brake_pipe").assign(brake_demand=form.ambient_pressure_pa + share * form.full_pressure_pa)
    note = (
        f"brake pipe: released at {released / scale:g} {unit}, --pipe-released; a full brake {FULL_DROP_PA / scale:g} "
        f"{unit} below; as the demand of {form.full_pressure_pa:g} Pa in the cylinders, --full-pressure"
    )
    return rows, replace(form, pipe_released=float(released / scale)), note

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A 0 that stands for no value among pressures or a wheel's turns: gone for a moment, and back the same."""

from collections.abc import Iterator

import numpy as np

from ....run.results.gone import LEAST_PA, LEAST_RADPS, gone
from ..format import PRESSURES
from ..whole.read import Log


def dropouts(log: Log) -> Iterator[str]:
    """Say which columns are 0 for moments only."""
    t_s = log.rows["t_ns"].to_numpy() / 1e9
    for name in (*PRESSURES[:2], *log.columns.axles):
        if name not in log.rows:
            continue
        values = log.rows[name].to_numpy() - log.form.offset(name)
        is_pipe = name in PRESSURES and name not in log.columns.names  # empty, it asks for a full brake
        mark = float(np.nanmax(values, initial=0.0)) if is_pipe else 0.0
        if rows := gone(t_s, values, LEAST_PA if name in PRESSURES else LEAST_RADPS, mark):
            what = "brake_pipe is at its lowest" if is_pipe else f"{name} is 0"
            yield f"{what} in {rows} rows between others of the same value: no value? Leave those cells empty"

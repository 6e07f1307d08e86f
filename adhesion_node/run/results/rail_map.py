# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The rail by place and date, out of what many brakings showed of it."""

import numpy as np
import pandas as pd


def map_of(cells: pd.DataFrame, cell_m: float) -> pd.DataFrame:
    """The rail by piece of track and date.

    `seen` counts brakings, `limited` those whose adhesion limited: `mu` is their mean, `mu_std` has their scatter and
    their own errors, `mu_lowest` is the least. `used` is the mean of what the trains used, whatever limited them.
    `mu_lower` is the least bound where adhesion limited, else the highest that was shown.
    """
    cells = cells.assign(
        date=pd.to_datetime(cells["t_ns"], utc=True).dt.strftime("%Y-%m-%d"),
        least=cells["mu_lower"].where(cells["limited"]),
        variance=cells["mu_std"] ** 2,
    )
    by = cells.groupby(["cell", "date"])
    rail = by.agg(
        seen=("t_ns", "size"),
        limited=("limited", "sum"),
        mu=("mu", "mean"),
        mu_lowest=("mu", "min"),
        variance=("variance", "mean"),
        scatter=("mu", "var"),
        used=("used", "mean"),
        least=("least", "min"),
        most=("mu_lower", "max"),
        speed_mps=("speed_mps", "mean"),
        t_ns=("t_ns", "max"),
    ).reset_index()
    rail["mu_std"] = np.sqrt(rail.pop("variance") + rail.pop("scatter").fillna(0.0))
    rail["mu_lower"] = rail.pop("least").fillna(rail.pop("most"))
    rail.insert(0, "place_m", rail.pop("cell") * cell_m)
    rail.insert(1, "length_m", cell_m)
    return rail

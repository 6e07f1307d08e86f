# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Rows that share a time and fill different cells, as of a bus whose signals have each their own: one row of all."""

import numpy as np
import pandas as pd


def together(rows: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """Return the rows, those of one time as the first of them where no cell is there twice, and what was done.

    >>> rows = pd.DataFrame({"t_ns": [1, 1, 2, 2], "position": [5.0, None, 6.0, 7.0], "speed": [None, 3.0, None, None]})
    >>> together(rows)[0].values.tolist()
    [[1.0, 5.0, 3.0], [2.0, 6.0, nan], [2.0, 7.0, nan]]
    """
    of_time = np.cumsum(np.diff(rows["t_ns"], prepend=rows["t_ns"].iloc[:1]) != 0)
    groups = rows.drop(columns="t_ns").groupby(of_time)
    share = (groups.size() > 1) & (groups.count() <= 1).all(axis=1)
    if not share.any():
        return rows, []
    shares = share.to_numpy()[of_time]
    first = np.diff(of_time, prepend=-1) != 0
    taken = rows[~shares | first].copy()
    names = rows.columns.drop("t_ns")
    taken.loc[shares[~shares | first], names] = groups.first()[share].to_numpy()
    left = len(rows) - len(taken)
    return taken, [f"time: {left} rows share theirs with the one before and fill other cells: taken together"]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A run as series over time: what its pictures, tables and pages are made from."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.physics.train import Array
from ...run.results.known import PRIOR, kind_of
from .creep import CreepCurves
from .numbers import CONFIDENCE, number
from .predicted import Curves
from .series import NONE, Series, Times, in_rows


class Run(NamedTuple):
    """The series of a recording; empty where it holds none."""

    true_mu: Series = NONE
    true_limited: Series = NONE
    """1 where adhesion limits a real train, as its simulator knows, else 0."""
    true_position: Series = NONE
    true_speed: Series = NONE
    pressure: Series = NONE
    """Gauge, Pa."""
    mu: Series = NONE
    mu_lower: Series = NONE
    position: Series = NONE
    speed: Series = NONE
    regime: Series = NONE
    safe: Curves = Curves()
    """On mu_lower, a weaker brake and the least resistance of the track; at most one for each estimate."""
    nominal: Curves = Curves()
    """On mu and the identified law over speed."""
    remarks: Series = NONE
    """What the estimator said while all was not well."""
    levels: Series = NONE
    """Of the ATP monitor."""
    changes: Series = NONE
    """Changes of the rail found so far, counted."""
    said: Mapping[str, Series] = MappingProxyType({})
    """Numbers of the ATP monitor by key, NaN where it does not tell one; all at the same times."""
    creep: CreepCurves = ()
    """Of the creep estimator."""
    counts: Mapping[str, str] = MappingProxyType({})
    """Last diagnostics by key."""
    told: Mapping[str, Series] = MappingProxyType({})
    """Further numbers of the estimates, where they were asked for."""

    @property
    def confidence(self) -> float | None:
        """Of the lower bound; None where the recording does not tell."""
        told = number(self.counts.get(CONFIDENCE, ""))
        return None if math.isnan(told) else told

    @property
    def kinds(self) -> Series:
        """What μ̂ is at each of its times, by `kind_of`."""
        t_ns, mu = self.mu
        columns = (mu, self.mu_lower.exactly(t_ns), self.regimes_at(t_ns))
        return Series(t_ns, np.array([kind_of(*row) for row in in_rows(*columns)], dtype=np.str_))

    @property
    def learnt(self) -> NDArray[np.bool_]:
        """At which estimates more is known of the adhesion than a prior; shape (n,)."""
        return np.asarray(self.kinds.exactly(self.speed.t_ns, PRIOR) != PRIOR)

    def regimes_at(self, t_ns: Times) -> NDArray[Any]:
        """Regimes of the estimates of those times by name; "" where none is recorded."""
        return self.regime.exactly(t_ns, "")

    def __eq__(self, other: object) -> bool:
        """A run is itself alone, so that what follows from it can be kept."""
        return self is other

    def __hash__(self) -> int:
        """By identity, as well."""
        return id(self)

    @property
    def origin_ns(self) -> int:
        """When the run starts."""
        return int(min(series.t_ns[0] for series in (self.speed, self.true_speed) if series.t_ns.size))

    @property
    def way(self) -> tuple[Series, Series]:
        """Place and speed of the train: the true ones where they are known."""
        known = self.true_position.t_ns.size > 0
        return (self.true_position, self.true_speed) if known else (self.position, self.speed)

    @property
    def sign(self) -> int:
        """-1 where the chainage falls along the run."""
        place = self.way[0].values
        return -1 if place[-1] < place[0] else 1

    def seconds(self, t_ns: Times) -> Array:
        """Times as seconds from the start of the run."""
        return np.asarray((t_ns - self.origin_ns) * 1e-9, dtype=np.float64)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The creep curve as the diagnostics of a recorded creep estimator told it."""

from collections import defaultdict
from operator import itemgetter
from typing import Any

from ...web.creep import creep_part
from ...wire.messages.results import Status
from .messages import with_key

CreepCurves = tuple[tuple[int, dict[str, Any]], ...]
"""Curves as the pages draw them, at their times, ns."""


class CreepTaken:
    """The curves of every train while the diagnostics are read; none where no creep estimator was recorded."""

    def __init__(self) -> None:
        self._told = defaultdict[str, list[tuple[int, dict[str, Any]]]](list)
        self.take = with_key("lambda_m", self._note)

    def _note(self, t_ns: int, status: Status) -> None:
        part = creep_part(status.values, status.message)
        if part is not None:
            self._told[status.namespace].append((t_ns, part))

    def curves(self, namespace: str = "") -> CreepCurves:
        """Those of the train of that namespace, or else of the one without, by their times."""
        return tuple(sorted(self._told.get(namespace, self._told[""]), key=itemgetter(0)))

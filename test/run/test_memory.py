# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is remembered of a run, however long it is."""

from __future__ import annotations

import tracemalloc
from array import array
from collections.abc import Iterator

import numpy as np

from adhesion_node.core import Config
from adhesion_node.run.offline import Recorded, predictions
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire.line import ATMOSPHERE_PA, NOMINAL
from adhesion_node.wire.messages.codec import plain
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION

S = 10**9


def test_memory_does_not_grow_with_the_run() -> None:
    """Of the offline replay: cruising and braking by turns of 15 s."""
    held: list[int] = []

    def recorded(turns: int) -> Iterator[Recorded]:
        for number in range(150 * turns):
            t_ns, pressure = number * S // 10, 410e3 * (number % 150 >= 100)
            place = 30.0 * number / 10.0 + 0.5 * float(rng.standard_normal())
            yield BRAKE_PRESSURE.name, BRAKE_PRESSURE.build(plain, t_ns, (pressure + ATMOSPHERE_PA,), 0.0, ""), t_ns
            yield POSITION.name, POSITION.build(plain, t_ns, (place,), 0.25, "track"), t_ns
            if number % 150 == 149:
                held.append(tracemalloc.get_traced_memory()[0])

    rng = np.random.default_rng(1)
    tracemalloc.start()
    try:
        for _ in predictions(Pipeline(Config(), 1), None, recorded(8), NOMINAL, array("d")):
            pass
    finally:
        tracemalloc.stop()
    assert held[-1] < held[3] + 600_000, "predictions that are kept would be twice as much"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A flood of samples takes bounded memory and work."""

from __future__ import annotations

import pickle
from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from watched import START_NS, S

from adhesion_node.core import Config, Outcome
from adhesion_node.core.intake import stream
from adhesion_node.core.intake.samples import PositionSample, PressureSample
from adhesion_node.core.methods.particle_em import method as particle_em
from adhesion_node.core.methods.particle_em.em import EStep, Identified, Search, identify
from adhesion_node.run.pipeline import Pipeline

FLOODS: dict[str, Callable[[int], int]] = {
    "fresh": lambda number: number * S // 1_000,  # of these 200 a second are used
    "one stamp": lambda _: 0,
    "two clocks": lambda number: number % 2 * 30 * S + number * S // 10_000,
    "back and forth": lambda number: number % 100 * S // 1000,
}
"""Stamps of 1000 or 10 000 messages a second."""


@pytest.mark.parametrize("stamps", FLOODS)
@pytest.mark.parametrize("pressures", [True, False])
def test_a_flood_takes_bounded_memory_and_work(stamps: str, pressures: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """No more windows than the accepted measurements allow, no more in memory than the inbox may hold."""
    evaluations = Counter[str]()

    def counted(e_step: EStep, search: Search) -> Identified:
        evaluations["done"] += 1
        return identify(e_step, search)

    monkeypatch.setattr(particle_em, "identify", counted)
    monkeypatch.setattr(stream, "MOST", 500)
    pipeline = Pipeline(Config(method="particle_em", iterations=1, particles=2, window=30, step=20), 1)
    rng = np.random.default_rng(1)
    sizes = []
    for number in range(6_000):
        after_ns = FLOODS[stamps](number)
        if pressures:
            pipeline.push(PressureSample(START_NS + after_ns, 410e3))
        place = 70.0 * after_ns * 1e-9 + 0.5 * rng.standard_normal()
        pipeline.push(PositionSample(START_NS + after_ns, place, 0.25))
        if number % 2_000 == 1_999:
            inbox = pipeline.state.inbox
            kept = (pipeline.state.window, inbox.anchors, [*inbox.others.values()], inbox.suspects)
            sizes.append(len(pickle.dumps(kept)))
    steps = pipeline.accepted / pipeline.config.step
    assert evaluations["done"] <= steps + pipeline.state.counts[Outcome.RESET] + 1
    assert sizes[-1] < 1.5 * sizes[0], sizes

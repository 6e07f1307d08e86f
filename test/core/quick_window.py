# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A method that is quick rather than good, a braking for it, and what became of the measurements."""

from __future__ import annotations

from adhesion_node.core import Config, State

FULL = 410e3
QUICK = Config(method="particle_em", window=20, step=5, particles=8, iterations=8)
"""The mechanics do not depend on the accuracy."""
STOP: list[tuple[float, float | None]] = [(5.0, 0.0), (8.0, FULL)]


def counts(state: State) -> dict[str, int]:
    return {outcome.name: count for outcome, count in state.counts.items() if count}

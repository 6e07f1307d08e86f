# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A node that gets a signal at any moment, also while it still imports, ends with 0 and silently, its bag complete."""

from __future__ import annotations

import pytest
from start_stop import tries


@pytest.mark.parametrize("seed", [1, 2])
def test_a_handful_of_random_moments(seed: int) -> None:
    assert [ending for ending in tries(4, seed) if ending.fault] == []

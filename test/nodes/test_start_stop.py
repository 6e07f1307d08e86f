# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A node that gets a signal at any moment, also while it still imports, ends with 0 and silently, its bag complete."""

from __future__ import annotations

import pytest
from start_stop import tries


@pytest.mark.parametrize("seed", [1, 2])
def test_a_handful_of_random_moments(seed: int) -> None:
    assert [ending for ending in tries(4, seed) if ending.fault] == []

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The second plant's runs: the same bits for a seed, whatever runs beside it."""

import numpy as np
import pytest

from sim_node.real.plant.scenarios import SCENARIOS
from sim_node.real.plant.simulate import simulate


@pytest.mark.parametrize("name", ["tram_leaves", "metro_wet"])
def test_a_seed_gives_the_same_bits_beside_other_seeds(name: str) -> None:
    alone = simulate(SCENARIOS[name], [7])[0]
    beside = simulate(SCENARIOS[name], [3, 7, 11])[1]
    for one, other in zip(alone, beside, strict=True):
        np.testing.assert_array_equal(one, other)

"""One simulated run: the true train and what its sensors show, from one seed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .plant import NOMINAL_NOISE, PlantNoise, Truth, simulate
from .scenario import Scenario
from .sensors import Reading, SensorSettings, measure


def run(
    scenario: Scenario,
    period_s: float,
    seed: int,
    settings: SensorSettings | None = None,
    noise: PlantNoise = NOMINAL_NOISE,
) -> Iterator[tuple[Truth, Reading]]:
    """Yield the truth and the reading of every sample; the node publishes exactly these.

    The plant and the sensors draw from separate streams of `seed` (at least 0), so that the true run does not
    depend on the sensors' settings. Raises ValueError as `simulate`.
    """
    plant_rng, sensor_rng = (np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(2))
    nominal = settings or SensorSettings()
    truths = simulate(scenario, period_s, plant_rng, noise)
    return ((truth, measure(truth, nominal, sensor_rng)) for truth in truths)

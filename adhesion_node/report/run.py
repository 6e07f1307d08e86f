"""A recorded run as series over time: what its picture and its table are made from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..bag import BagReader
from ..core import braking
from ..core.train import Array, Train
from ..topics import BRAKE_PRESSURE, DIAGNOSTICS, MU, MU_LOWER, STATE, TRUTH_MU, TRUTH_STATE
from .series import Series, read_series, read_status

FIXED_MU = 0.0726
"""The worst case by which trains brake where the adhesion is not known (Xie et al. 2019)."""


class Run(NamedTuple):
    """The series of a recording; those of the truth are empty where it holds none."""

    true_mu: Series
    true_position: Series
    true_speed: Series
    pressure: Series
    """Absolute, Pa."""
    mu: Series
    mu_lower: Series
    speed: Series
    regime: Series


def read_run(reader: BagReader) -> Run:
    """Read the series. Raises ValueError when the recording holds no estimates."""
    run = Run(
        true_mu=read_series(reader, TRUTH_MU, lambda message: message.data),
        true_position=read_series(reader, TRUTH_STATE, lambda message: message.pose.pose.position.x),
        true_speed=read_series(reader, TRUTH_STATE, lambda message: message.twist.twist.linear.x),
        pressure=read_series(reader, BRAKE_PRESSURE, lambda message: message.fluid_pressure),
        mu=read_series(reader, MU, lambda message: message.data),
        mu_lower=read_series(reader, MU_LOWER, lambda message: message.data),
        speed=read_series(reader, STATE, lambda message: message.twist.twist.linear.x),
        regime=read_status(reader, DIAGNOSTICS, "regime"),
    )
    for topic, series in ((MU, run.mu), (MU_LOWER, run.mu_lower), (STATE, run.speed)):
        if not series.t_ns.size:
            raise ValueError(f"bag = {reader.path}: holds no {topic.name}: record while the estimator runs")
    return run


def distance_to_target(run: Run, mu: Array | float, target_mps: float, train: Train) -> Array:
    """Braking distance, m, from the speed at each estimate to the target speed with adhesion `mu`; 0 below it."""
    speeds = run.speed.values
    return np.array(
        [
            float(braking.curve(train, float(speed), float(value), min(target_mps, float(speed))).distance_m[-1])
            for speed, value in zip(speeds, np.broadcast_to(mu, speeds.shape), strict=True)
        ]
    )

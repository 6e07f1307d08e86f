# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What He et al. 2017 leave out: noise on the creep, how sure the peak is, when it must be withheld, the iteration."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ...command.running import Arrays
from ...core.creep import fit as creep_fit
from ...core.creep.curve import noise_products, peak
from ...core.creep.recursion import Recursion, full_covariance
from ...core.physics.train import Array
from . import errors_in_variables as creep_eiv
from . import runs as he

CREEP_STDS = (0.0005, 0.001, 0.002)
"""Noise of the creep: speeds of 10 m/s measured to 0.005, 0.01 and 0.02 m/s."""

MANY = 400
"""Runs of what needs no more than the recursion: coverage and withholding."""

WRONG = 0.1
"""A published peak further from the truth than this share of it is wrong."""


def with_creep_noise(creep_std: float) -> Callable[[int, int], list[dict[str, Any]]]:
    """Peak from the dry creeps up to 0.03 with noise on mu and on the creep: plain, compensated, maximum likelihood."""

    def rows(runs: int, seed: int) -> list[dict[str, Any]]:
        creeps = he.rise(he.RAMP)[: round(he.RAMP * he.ENOUGH / he.LAMBDA_M)]
        data = he.measure(creeps, he.on_one(creeps), runs, seed, in_mu=True, creep_std=creep_std)
        variances = np.full(data.creep.shape, creep_std**2), np.full(data.creep.shape, he.NOISE_STD**2)
        expected = noise_products(data.creep, data.adhesion, he.SLOPE, *variances)
        found = {
            "least squares": he.peaks(he.identify(he.ONE, data).theta[-1]),
            "compensated least squares": he.peaks(he.identify(he.ONE, data, expected).theta[-1]),
            "errors in variables": _likeliest(data, creep_std),
        }
        table = [
            he.peak_row(f"creep noise {creep_std:g}, {method}", he.DRY_PEAK, values, he.ENOUGH / he.LAMBDA_M)
            for method, values in found.items()
        ]
        return [row | {"bias_percent": 100.0 * (row["peak_estimated_mean"] / he.DRY_PEAK - 1.0)} for row in table]

    return rows


def _likeliest(data: he.Data, creep_std: float) -> Array:
    noise = creep_eiv.NoiseStd(creep_std, he.NOISE_STD)
    thetas = [
        creep_eiv.fit(creeps, adhesions, he.SLOPE, he.START_SHARE * he.DRY, noise).theta
        for creeps, adhesions in zip(data.creep.T, data.adhesion.T, strict=True)
    ]
    return he.peaks(np.array(thetas))


def coverage(seed: int) -> dict[str, float]:
    """Share of runs whose 95 % interval of mu_max, and of l_m, holds the truth after one rise, by kind of noise."""
    creeps, shares = he.rise(), {}
    for name, in_mu in (("v of (7)", False), ("mu", True)):
        last = he.identify(he.ONE, he.measure(creeps, he.on_one(creeps), MANY, seed, in_mu=in_mu)).last
        for index, (what, values, truth) in enumerate(
            zip(("mu_max", "lambda_m"), peak(he.SLOPE, last.theta), peak(he.SLOPE, he.DRY), strict=True)
        ):
            inside = np.abs(values - truth) <= 1.96 * _stds(last)[..., 2 + index]
            shares[f"{what}, noise in {name}"] = float(np.mean(inside))
    return shares


def withholding(seed: int) -> list[dict[str, float]]:
    """By the creep reached: how many peaks are published and how many of them are wrong, against publishing all.

    Dry and wet rises, half of the runs each, noise in mu.
    """
    creeps, runs, rows = he.rise(), MANY // 2, []
    halves = [
        (truth, he.measure(creeps, he.on_one(creeps, theta), runs, seed, in_mu=True))
        for theta, truth in ((he.DRY, he.DRY_PEAK), (he.WET, he.WET_PEAK))
    ]
    for end in (round(he.RISE * share) for share in (0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 1.0)):
        cut = [(truth, he.Data(*(column[:end] for column in data))) for truth, data in halves]
        lasts = [(truth, he.identify(he.ONE, data).last) for truth, data in cut]
        wrong = np.concatenate([np.abs(he.peaks(last.theta) - truth) > WRONG * truth for truth, last in lasts])
        published = np.concatenate([_published(last) for _, last in lasts])
        rows.append(
            {
                "creep_reached": float(creeps[end - 1]),
                "published": float(np.mean(published)),
                "wrong_of_published": float(np.mean(wrong[published])) if published.any() else 0.0,
                "wrong_of_all": float(np.mean(wrong)),
            }
        )
    return rows


def _published(last: Recursion) -> Array:
    """Which runs tell the peak by the criteria of `core.creep.recursion.judge`; on one surface none is changing."""
    values = he.peaks(last.theta)
    positive = (last.theta > 0.0).all(axis=-1)
    enough = last.sums.weight >= he.ONE.min_samples
    return np.asarray(enough & positive & (_stds(last)[..., 2] <= he.ONE.max_relative_std * values))


def _stds(last: Recursion) -> Array:
    """Standard deviations of p1, p2, mu_max and l_m, shape (runs, 4)."""
    covariance = full_covariance(he.SLOPE, last.theta, creep_fit.covariance(last.sums, last.theta))
    return np.asarray(np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1)))


def dfp_difference(runs: int, seed: int) -> float:
    """Largest relative difference of p1 or p2 between the iteration and the exact minimum over experiment 1.

    From the 50th sample on: before, the data hardly span two directions and both minima are as good.
    """
    creeps = he.rise()
    data = he.measure(creeps, he.on_one(creeps), runs, seed)
    exact, iterated = (he.identify(replace(he.ONE, solver=solver), data).theta[50:] for solver in ("exact", "dfp"))
    return float(np.max(np.abs(iterated - exact) / np.maximum(np.abs(exact), 1.0)))


BEYOND: Mapping[str, Callable[[int, int], Any]] = {
    **{f"noise{std:g}": with_creep_noise(std) for std in CREEP_STDS},
    "coverage": lambda _runs, seed: coverage(seed),
    "withholding": lambda _runs, seed: withholding(seed),
    "dfp": dfp_difference,
}
"""What the paper leaves out, by name: plain values of runs and seed."""


class Beyond(NamedTuple):
    """One of `BEYOND`."""

    what: str
    runs: int
    seed: int

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"creep-{self.what}"

    @property
    def weight(self) -> float:
        """How much work it is beside the samples of an experiment."""
        return 8000.0

    def compute(self) -> Arrays:
        """The values as JSON in one text."""
        return {"json": np.array(json.dumps(BEYOND[self.what](self.runs, self.seed)))}


def value_of(found: Arrays) -> Any:
    """Read what `Beyond.compute` wrote."""
    return json.loads(str(found["json"]))

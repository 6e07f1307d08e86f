# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The digest of a run holds every published number, whichever curve it is of and in whatever order."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from test_pipeline import FAST, clean, feed, pressures_first

from adhesion_node.core import Config, Estimate, Regime
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.core.prediction import Prediction, predict
from adhesion_node.run import pipeline as pipeline_module
from adhesion_node.run.pipeline import Pipeline

BASE = predict(
    Config(),
    Estimate(
        t_ns=123_456_789_000,
        mu=0.08,
        mu_std=0.01,
        mu_lower=0.06,
        regime=Regime.ADHESION_LIMITED,
        position_m=1000.0,
        speed_mps=60.0,
        position_std_m=0.3,
        speed_std_mps=0.2,
        window=50,
        iterations=12,
        converged=True,
        log_likelihood=-31.5,
        ess=7.5,
    ),
)


def flipped(value: Any) -> Any:
    """Return the nearest other value."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    return Regime.BRAKE_LIMITED if isinstance(value, Regime) else math.nextafter(value, math.inf)


def flipped_curve(curve: BrakingCurve, column: str, index: int) -> BrakingCurve:
    names = ("distance_m", "speed_mps", "deceleration_mps2", "time_s")
    columns = {name: getattr(curve, name).copy() for name in names}
    columns[column][index] = np.nextafter(columns[column][index], math.inf)
    return BrakingCurve(**columns)


def digest_of(prediction: Prediction, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the digest of a pipeline that publishes this prediction alone."""
    monkeypatch.setattr(pipeline_module, "predict", lambda config, estimate: prediction)
    pipeline = Pipeline(FAST, 1)
    assert feed(pipeline, pressures_first(clean()[:10])) == [prediction]
    return pipeline.digest


@pytest.mark.parametrize("field", [each for each in Estimate._fields if each not in ("shape", "withheld", "ahead")])
def test_the_digest_holds_every_number_of_an_estimate(field: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Shape and what is withheld show in the curves."""
    changed = BASE.estimate._replace(**{field: flipped(getattr(BASE.estimate, field))})
    digests = {digest_of(prediction, monkeypatch) for prediction in (BASE, BASE._replace(estimate=changed), BASE)}
    assert len(digests) == 2


@pytest.mark.parametrize("which", ["safe", "nominal"])
@pytest.mark.parametrize("column", ["distance_m", "speed_mps", "deceleration_mps2", "time_s"])
@pytest.mark.parametrize("index", [0, 31, -1])
def test_the_digest_holds_every_number_of_the_curves(
    which: str, column: str, index: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    curve: BrakingCurve | None = getattr(BASE, which)
    assert curve is not None
    flipped_ = flipped_curve(curve, column, index)
    changed = BASE._replace(safe=flipped_) if which == "safe" else BASE._replace(nominal=flipped_)
    assert digest_of(changed, monkeypatch) != digest_of(BASE, monkeypatch)


def test_the_digest_tells_which_curve_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    same = BASE._replace(nominal=BASE.safe)
    variants = (same, same._replace(safe=None), same._replace(nominal=None), same._replace(safe=None, nominal=None))
    assert len({digest_of(prediction, monkeypatch) for prediction in variants}) == len(variants)


def test_the_order_of_the_curves_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    swapped = BASE._replace(safe=BASE.nominal, nominal=BASE.safe)
    assert digest_of(swapped, monkeypatch) != digest_of(BASE, monkeypatch)

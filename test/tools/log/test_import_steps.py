# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A column of coarse steps is no better known than they let it be, and that is said."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

from adhesion_node.core.physics.train import Array
from adhesion_node.wire.topics import SPEED

__all__ = ["importing"]

ROOT_12 = math.sqrt(12.0)

COARSE: list[tuple[str, Callable[[pd.DataFrame], pd.DataFrame], list[str], str, float, float]] = [
    ("tens of metres", lambda r: r.assign(position=r.position.round(-1)), [], "10 m", 10.0 / ROOT_12, 0.0),
    (
        "hundredths of a kilometre",
        lambda r: r.assign(position=(r.position / 1e3).round(2)),
        ["--position-unit", "km"],
        "10 m",
        10.0 / ROOT_12,
        0.0,
    ),
    ("whole metres", lambda r: r.assign(position=r.position.round()), [], "1 m", 0.5, 0.0),
    (
        "5 km/h",
        lambda r: r.assign(speed=(r.speed * 0.72).round() * 5),
        ["--speed-unit", "kmh"],
        "1.389 m/s",
        0.5,
        5.0 / 3.6 / ROOT_12,
    ),
    (
        "5 km/h as m/s",
        lambda r: r.assign(speed=((r.speed * 0.72).round() / 0.72).round(2)),
        [],
        "1.39 m/s",
        0.5,
        1.39 / ROOT_12,
    ),
    ("whole km/h", lambda r: r.assign(speed=(r.speed * 3.6).round()), ["--speed-unit", "kmh"], "0.2778 m/s", 0.5, 0.0),
]


@pytest.mark.parametrize(
    ("change", "options", "said", "position_std", "speed_std"),
    [case[1:] for case in COARSE],
    ids=[c[0] for c in COARSE],
)
def test_a_step_bounds_the_deviation_and_is_said(
    importing: Import,
    capsys: pytest.CaptureFixture[str],
    change: Callable[[pd.DataFrame], pd.DataFrame],
    options: list[str],
    said: str,
    position_std: float,
    speed_std: float,
) -> None:
    log = text(change(ride()))
    assert importing(log, *options) == 0, importing.errors
    assert importing.positions()[0].variance_m2 == pytest.approx(position_std**2)
    told = SPEED.read(importing.messages("speed")[0]).variance
    assert math.sqrt(told or 0.0) == pytest.approx(speed_std, rel=2e-3)
    (line,) = [line for line in read_as(importing, capsys, *options) if "in steps of" in line]
    assert said in line


def test_what_is_told_counts_more_than_the_step(importing: Import) -> None:
    rows = ride().assign(position=ride().position.round(-1), speed=(ride().speed * 0.2).round() * 5, speed_std=0.1)
    importing(text(rows), "--position-std", "1.5")
    assert importing.positions()[0].variance_m2 == 2.25
    assert SPEED.read(importing.messages("speed")[0]).variance == pytest.approx(0.01)
    importing.output = importing.output.with_name("column")
    importing(text(rows.assign(variance=4.0)))
    assert importing.positions()[0].variance_m2 == 4.0


def test_coarse_degrees_are_told(importing: Import, capsys: pytest.CaptureFixture[str]) -> None:
    rows = ride().assign(lat=(47.0 + ride().position / 111_181.0).round(4), lon=8.0).drop(columns="position")
    assert importing(text(rows)) == 0
    assert importing.messages("fix")[0].position_covariance[0] == pytest.approx(11.12**2 / 12.0)
    assert any(line.startswith("fix: in steps of 11.12 m") for line in read_as(importing, capsys))


@pytest.mark.parametrize("speed", [30.0, 50.0 + 0.3 * np.sin(np.arange(60) / 10)], ids=["to the bit", "nearly"])
def test_a_steady_speed_is_no_step(importing: Import, capsys: pytest.CaptureFixture[str], speed: Array | float) -> None:
    """Its positions, once a second, lie by equal ways apart."""
    rows = pd.DataFrame({"time": np.arange(60.0), "speed": speed})
    assert importing(text(rows.assign(position=1000.0 + rows.speed.cumsum()).round(2))) == 0
    assert not [line for line in read_as(importing, capsys) if "in steps of" in line]

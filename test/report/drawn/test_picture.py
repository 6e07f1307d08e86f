# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The picture of a recorded run: drawn whole, with and without the truth."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from slowing import FREE, TRUTH, S, read, record, recorded

from adhesion_node.report.drawn import picture
from adhesion_node.report.drawn.charts import Chart, Line
from adhesion_node.report.found.distances import distance_to_target
from adhesion_node.report.found.regimes import Band
from adhesion_node.report.read.run import Run
from adhesion_node.report.read.series import Series
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_PRESSURE, DIAGNOSTICS, MU, MU_LOWER, STATE

__all__ = ["recorded"]


def png_size(path: Path) -> tuple[int, ...]:
    content = path.read_bytes()
    assert content.startswith(b"\x89PNG\r\n\x1a\n")
    assert content.rstrip().endswith(b"IEND\xaeB`\x82")
    return struct.unpack(">II", content[16:24])


def pixels_of(path: Path, color: str) -> int:
    """Count the pixels of a colour "#rrggbb"."""
    wanted = [int(color[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    return int(np.all(np.abs(imread(path)[..., :3] - wanted) < 0.02, axis=-1).sum())


@pytest.mark.parametrize("left_out", [(), TRUTH, (BRAKE_PRESSURE,), (DIAGNOSTICS,), (*TRUTH, DIAGNOSTICS)])
def test_a_picture_is_drawn_of_what_there_is(left_out: tuple[Topic, ...], tmp_path: Path) -> None:
    path = tmp_path / "run.png"
    picture.draw(read(record(tmp_path / "bag", *left_out)), [path], "a run", 100.0)
    assert png_size(path) == (1210, 1320)
    told = DIAGNOSTICS not in left_out  # without regimes nothing is known to be identified
    assert pixels_of(path, picture.ORANGE) > (1000 if told else 500), "the curves by mu are missing"
    assert pixels_of(path, picture.BLUE) > 300, "the lower bounds are missing"
    shaded = pixels_of(path, picture.SHADES["ADHESION_LIMITED"])
    assert (shaded > 50_000) is (DIAGNOSTICS not in left_out)


def test_a_name_is_no_formula(recorded: Run, tmp_path: Path) -> None:
    picture.draw(recorded, [tmp_path / "run.png"], r"a$\frac$^{b", 0.0)
    assert png_size(tmp_path / "run.png") > (600, 600)


def test_the_truth_is_drawn_where_there_is_one(tmp_path: Path) -> None:
    black = []
    for name, left_out in (("with", ()), ("without", TRUTH)):
        path = tmp_path / f"{name}.png"
        picture.draw(read(record(tmp_path / name, *left_out)), [path], "a run", 100.0)
        black.append(pixels_of(path, picture.BLACK))
    assert black[0] > black[1] + 500


def test_what_truly_limited_stands_above_what_the_estimator_said(recorded: Run, tmp_path: Path) -> None:
    path, truth = tmp_path / "run.png", [Band(0.0, 3.0, "BRAKE_LIMITED"), Band(3.0, 19.0, "ADHESION_LIMITED")]
    picture.draw(recorded, [path], "a run", 100.0, truth=truth)
    strips = [pixels_of(path, picture.TRUE_SHADES[regime]) for regime in ("BRAKE_LIMITED", "ADHESION_LIMITED")]
    assert strips[0] > 1000
    assert strips[1] / strips[0] == pytest.approx(16.0 / 3.0, rel=0.3)


def test_a_single_estimate_is_drawn(tmp_path: Path) -> None:
    picture.draw(read(record(tmp_path / "bag", seconds=1)), [tmp_path / "run.png"], "short", 0.0)
    assert png_size(tmp_path / "run.png") == (1210, 1320)


@pytest.mark.parametrize("left_out", [(MU,), (STATE,), (MU, MU_LOWER, STATE)])
def test_without_estimates_it_says_what_to_do(left_out: tuple[Topic, ...], tmp_path: Path) -> None:
    path = record(tmp_path / "bag", *left_out)
    with pytest.raises(ValueError, match=r"bag = .*: holds no adhesion/\w+: record while the estimator runs"):
        read(path)


def test_a_chart_of_zeros_has_an_axis_with_different_numbers() -> None:
    zeros = Series(np.array([0, S]), np.zeros(2))
    assert Chart("Forces, kN", 1, [Line("brake B", "fixed", zeros)]).range == (0.0, 1.0)
    some = zeros.map(lambda values: values - [0.0, 5.0])
    assert Chart("saved, m", 1, [Line("by μ̂", "nominal", some)]).range == pytest.approx((-5.4, 0.0))


def test_a_train_that_stands_may_seem_to_roll_back(recorded: Run) -> None:
    """A speed has a sign; before, a picture of a train that stops was refused."""
    back = recorded._replace(speed=recorded.speed.map(np.negative))
    assert distance_to_target(back, 0.0726, 0.0, FREE) == pytest.approx(distance_to_target(recorded, 0.0726, 0.0, FREE))

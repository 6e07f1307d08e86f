# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""An accelerometer whose three axes tell that it is in another unit than m/s^2, or lies on its head, is left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from adhesion_node.core import ImuSample
from adhesion_node.run.reader import Reader
from adhesion_node.wire.line import Line
from adhesion_node.wire.messages.codec import plain
from adhesion_node.wire.messages.parts import NS
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.topics import ADHESION_INPUTS, IMU

Axes = tuple[float, float, float]

G, HZ = 9.81, 50
NAN = float("nan")


def read(reader: Reader, axes: Sequence[Axes], *, begin_s: float = 0.0) -> list[str]:
    """What becomes of messages with these axes: "", or why they are refused."""
    said = []
    for index, (x, y, z) in enumerate(axes):
        message = IMU.build(plain, round((begin_s + index / HZ) * NS), (x,), 0.0025)
        message.linear_acceleration.y, message.linear_acceleration.z = y, z
        try:
            sample = reader.read(IMU, message)
        except Rejected as refused:
            said.append(f"{refused.reason} {refused}")
        else:
            assert isinstance(sample, ImuSample)
            assert sample.acceleration_mps2 == x
            said.append("")
    return said


def shown(seconds: float, mean: Callable[[float], Axes], noise: float = 0.05, unit: float = 1.0) -> list[Axes]:
    """What a device shows whose axes feel that in m/s^2, in its unit."""
    rng = np.random.default_rng(1)
    felt = (np.array(mean(index / HZ)) + noise * rng.standard_normal(3) for index in range(round(seconds * HZ)))
    return [(float(x), float(y), float(z)) for x, y, z in (unit * each for each in felt)]


def braked(x_mps2: float = -1.0, across: tuple[float, float] = (0.0, G)) -> Callable[[float], Axes]:
    """A train that is braked from 10 s on."""
    return lambda at_s: (x_mps2 if at_s > 10.0 else 0.0, *across)


@pytest.mark.parametrize(
    "axes",
    [
        shown(60.0, braked()),
        shown(60.0, braked(), noise=5.0),
        shown(60.0, braked(across=(0.0, -G))),
        shown(60.0, braked(across=(G, 0.0))),
        shown(60.0, braked(across=(0.0, 0.0))),
        shown(60.0, braked(across=(NAN, NAN))),
        shown(60.0, lambda at_s: (-1.0, 0.0, 0.0)),
        shown(60.0, lambda at_s: (0.0, 1.0 if 20.0 < at_s < 45.0 else 0.0, 0.0)),
        shown(10.0, lambda at_s: (-2.7, 0.0, G)),
        [(0.1, 1e308, 1e308), (0.2, float("inf"), 0.0), *shown(1.0, braked())],
    ],
    ids=["z", "shocks", "z down", "y", "without gravity", "x alone", "braked", "curve", "strong", "absurd"],
)
def test_what_is_in_mps2_is_used(axes: list[Axes]) -> None:
    assert set(read(Reader(ADHESION_INPUTS, Line()), axes)) == {""}


@pytest.mark.parametrize("across", [(0.0, G), (0.0, -G), (-G, 0.0)])
@pytest.mark.parametrize(("unit", "told"), [(1.0 / G, "1"), (1000.0 / G, "1e+03"), (100.0, "981"), (3.281, "32.2")])
def test_another_unit_is_told_and_left_out_at_once(unit: float, told: str, across: tuple[float, float]) -> None:
    said = read(Reader(ADHESION_INPUTS, Line()), shown(60.0, braked(across=across), unit=unit))
    assert said[:4] == [""] * 4
    assert all(each.startswith("ACCELERATION_UNIT ") for each in said[5:])
    assert f"imu linear_acceleration across the track = {told} in the mean: " in said[-1]
    assert "multiply g by 9.80665" in said[-1]


def test_shocks_hide_the_unit_for_a_while_only() -> None:
    said = read(Reader(ADHESION_INPUTS, Line()), shown(30.0, braked(), noise=4.0, unit=1.0 / G))
    assert all(each.startswith("ACCELERATION_UNIT ") for each in said[10 * HZ :])


@pytest.mark.parametrize("along", [G, -G, 0.5 * G])
def test_gravity_along_the_track_is_told_and_left_out(along: float) -> None:
    said = read(Reader(ADHESION_INPUTS, Line()), shown(20.0, lambda _: (along, 0.0, 0.1)))
    assert all(each.startswith("GRAVITY_ALONG ") for each in said[5:])
    assert f"imu linear_acceleration x = {along:.2f} in the mean: no train" in said[-1]


def test_a_device_that_is_mended_is_used_again() -> None:
    reader = Reader(ADHESION_INPUTS, Line())
    assert read(reader, shown(60.0, braked(), unit=1.0 / G))[-1]
    said = read(reader, shown(120.0, braked()), begin_s=61.0)
    assert said[-1] == ""
    assert read(reader, shown(1.0, braked()), begin_s=0.0)[-1] == "", "a time that begins anew"

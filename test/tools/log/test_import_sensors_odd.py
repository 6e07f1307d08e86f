# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Pressures, accelerometer and wheels that tell of another motion than the train's: their unit, or axis, is said."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import ride, text

from adhesion_node.nodes import replay

__all__ = ["importing"]

Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("factor", "told"),
    [
        (1e-5, "is 3 pa at most: is it in bar or kgcm2? --pressure-unit bar: 3 bar"),
        (1e-6, "is it in mpa? --pressure-unit mpa: 3 bar"),
        (1e-2, "is it in mbar? --pressure-unit mbar: 3 bar"),
        (
            1.0 / 6894.757,
            "is it in psi? --pressure-unit psi: 3 bar; or of a full brake? --pressure-unit percent",
        ),
        (
            100.3 / 3e5,
            "is it in kpa or psi? --pressure-unit kpa: 1 bar; --pressure-unit psi: 6.9 bar; or of a full brake?",
        ),
    ],
)
def test_pressures_in_another_unit_are_told(importing: Import, factor: float, told: str) -> None:
    rows = ride()
    assert importing(text(rows.assign(brake_pressure=(factor * rows.brake_pressure).round(6)))) == 1
    assert [said for said in importing.summary["odd"] if told in said]


def test_a_pressure_in_another_unit_than_the_option_says_is_told(importing: Import) -> None:
    rows = ride()
    assert importing(text(rows.assign(brake_pressure=rows.brake_pressure / 1e5)), "--pressure-unit", "kpa") == 1
    (odd,) = importing.summary["odd"]
    assert odd.startswith("brake_pressure is 3 kpa at most: is it in bar or kgcm2? --pressure-unit bar: 3 bar; ")


@pytest.mark.parametrize("factor", [1.0, 1.0 / 9.80665, -1.0])
def test_an_accelerometer_that_tells_of_another_motion_is_told(importing: Import, factor: float) -> None:
    """0.8 m/s^2 under the brake, with a bias of 0.05 m/s^2."""
    rows = ride().assign(acceleration=lambda rows: factor * (-0.8 * (rows.time >= 20.0) - 0.05))
    importing(text(rows))
    told = [said for said in importing.summary["odd"] if said.startswith("the acceleration is")]
    cure = {1.0: None, -1.0: "change its sign"}.get(factor, "another unit? --acceleration-unit g")
    assert len(told) == (cure is not None)
    assert cure is None or cure in told[0]


@pytest.mark.parametrize(
    ("per_mps", "read_as", "unit"),
    [
        (1 / 0.46, "radps", None),
        (1 / 0.35, "radps", None),
        (1.0, "radps", "mps"),
        (8.0, "radps", ""),
        (0.2, "radps", ""),
        (1 / 0.46, "rpm", "radps"),
    ],
)
def test_wheels_that_turn_otherwise_than_the_train_runs_are_told(
    importing: Import, per_mps: float, read_as: str, unit: str | None
) -> None:
    """Of a wheel of 0.46 m, and of a smaller one; the last are of no unit. What slides tells nothing."""
    rows = ride().assign(wheel_speed_1=lambda rows: per_mps * rows.speed * np.where(rows.time > 30.0, 0.5, 1.0))
    importing(text(rows), "--wheel-radius", "0.46", "--wheel-unit", read_as)
    told = [said for said in importing.summary["odd"] if said.startswith("the wheels turn")]
    assert len(told) == (unit is not None)
    assert not unit or told[0].endswith(f"another unit? --wheel-unit {unit}")


@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_an_axle_that_turns_backwards_is_told_by_all(importing: Import, capsys: Capture, speed: float) -> None:
    """But not where the train itself runs back, by its positions: then these are told."""
    rows = ride().assign(wheel_speed_1=lambda rows: rows.speed / 0.46, wheel_speed_2=lambda rows: -rows.speed / 0.46)
    back = rows.assign(position=speed * rows.position, speed=speed * rows.speed)
    assert importing(text(back)) == 1
    told = "wheel_speed_2: turned backwards while the train runs: change the sign, wheels count forward along the run"
    assert (told in importing.summary["odd"]) == (speed > 0.0)
    replay.main([str(importing.output), "--offline"])
    assert ("replay: axle 2: turned backwards while the train runs" in capsys.readouterr().err) == (speed > 0.0)


def test_all_that_is_odd_is_told_at_once(importing: Import) -> None:
    rows = ride()
    wrong = rows.assign(brake_pressure=rows.brake_pressure / 1e5, position=(120_000.0 - rows.position) / 1e3)
    assert importing(text(wrong.assign(speed=3.6 * rows.speed))) == 1
    told = " ".join(importing.summary["odd"])
    assert all(cure in told for cure in ("--pressure-unit bar", "--direction down", "--position-unit km"))
    assert "--speed-unit kmh" in told


@pytest.mark.parametrize("axis", [lambda r: 0.0 * r.speed + 9.81, lambda r: np.sin(r.time)])
def test_an_accelerometer_along_another_axis_is_said(importing: Import, axis: Callable[[pd.DataFrame], Any]) -> None:
    rows = ride()
    assert importing(text(rows.assign(acceleration=axis(rows)))) == 1
    assert any("along another axis" in odd for odd in importing.summary["odd"])


def test_a_demand_that_is_a_share_is_said(importing: Import) -> None:
    rows = ride()
    pressed = rows.brake_pressure / 1e5
    log = text(rows.assign(brake_pressure=pressed, brake_demand=(pressed > 0.1) * 1.0))
    assert importing(log, "--pressure-unit", "bar") == 1
    assert any(
        "is it a share of a full brake? Name its column brake_demand [full]" in odd for odd in importing.summary["odd"]
    )


@pytest.mark.parametrize("name", ["brake_pressure", "brake_demand", "brake_pipe"])
def test_a_pressure_that_is_written_where_it_changes_alone_is_told(importing: Import, name: str) -> None:
    """In between it is no older than it was, but counts as unknown."""
    pressure = 5e5 - ride().brake_pressure / 2.0 if name == "brake_pipe" else ride().brake_pressure
    rows = ride().drop(columns="brake_pressure").assign(**{name: pressure})
    assert importing(text(rows)) == 0, importing.errors
    importing.output = importing.output.with_name("on change")
    assert importing(text(rows.assign(**{name: pressure.where(pressure.diff() != 0.0)}))) == 1
    (odd,) = importing.summary["odd"]
    assert odd.startswith(f"{name} has a value in 2 of 600 rows, each another than before, and none for 39.9 s: is it ")
    importing.output = importing.output.with_name("held")
    assert "--hold" in odd
    assert importing(text(rows.assign(**{name: pressure.where(pressure.diff() != 0.0)})), "--hold") == 0
    topic = "brake_pressure" if name == "brake_pressure" else "brake_demand"
    assert len(importing.messages(topic)) == 600


@pytest.mark.parametrize("every", [10, 100])
def test_a_slow_pressure_is_not_written_on_a_change(importing: Import, every: int) -> None:
    rows = ride()
    importing(text(rows.assign(brake_pressure=rows.brake_pressure.where(rows.index % every == 0))))
    assert "changes alone" not in str(importing.summary["odd"])


@pytest.mark.parametrize(("pa", "told"), [(6894.757, "43.51 bar at most: is it in psi"), (1e4, "30 bar")])
def test_a_pressure_of_no_brake_is_told(importing: Import, pa: float, told: str) -> None:
    """Taken as measured it makes every rail slippery."""
    rows = ride().assign(brake_pressure=(ride().brake_pressure / pa).round(2))
    assert importing(text(rows.rename(columns={"brake_pressure": "brake_pressure [bar]"}))) == 1
    (odd,) = importing.summary["odd"]
    assert odd.startswith(f"brake_pressure is {told}")
    assert odd.endswith("or are they counts, of tenths? Divide them")


@pytest.mark.parametrize("off", [-0.6, 0.5])
def test_an_accelerometer_that_is_off_by_more_than_a_grade_is_told(importing: Import, off: float) -> None:
    felt = -0.8 * (ride().time >= 20.0)
    assert importing(text(ride().assign(acceleration=felt + 0.3))) == 0, importing.errors
    importing.output = importing.output.with_name("off")
    assert importing(text(ride().assign(acceleration=felt + off))) == 1
    (odd,) = importing.summary["odd"]
    assert odd.startswith(f"the acceleration is {off:+.2g} m/s^2 beside what the speed changes by, more than any grade")

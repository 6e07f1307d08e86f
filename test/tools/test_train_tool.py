# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`train`: what a train's file means and what in it is unlikely; brake and resistance out of a recording."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cdrs
import numpy as np
import pytest
from oracles import G

from adhesion_node.bag import BagWriter
from adhesion_node.tools.train import __main__ as train
from adhesion_node.wire.files.train import SHIPPED, read_train
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION

Told = tuple[int, str, str]


def told(capfd: pytest.CaptureFixture[str], *args: str) -> Told:
    capfd.readouterr()
    code = train.main(args)
    return code, *capfd.readouterr()


@pytest.mark.parametrize("name", ["high_speed", "metro", "freight"])
def test_nothing_about_a_shipped_train_is_unlikely(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    code, out, err = told(capfd, "--check", name)
    assert (code, err) == (0, "")
    assert out.startswith(read_train(name).name)
    assert "unlikely" not in out


def test_the_dry_stopping_distance_is_that_of_the_deceleration(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    flat = (
        (SHIPPED / "metro.yaml")
        .read_text(encoding="utf-8")
        .replace("c0: 1.2, c1: 0.0081, c2: 0.00026", "c0: 0, c1: 0, c2: 0")
    )
    path, result = tmp_path / "flat.yaml", tmp_path / "result.json"
    path.write_text(flat, encoding="utf-8")
    _, out, _ = told(capfd, "--check", str(path), "--json", str(result))
    found = json.loads(result.read_text(encoding="utf-8"))
    assert found["brake_per_mass_mps2"] == pytest.approx(1.3 * 1.06)
    first = found["stopping"][0]
    v = 80 / 3.6
    assert first["from_kmh"] == 80
    assert first["built_up_m"] == pytest.approx(v**2 / 2 / 1.3, rel=1e-3)
    assert first["distance_m"] == pytest.approx(v**2 / 2 / 1.3 + v * 2.0 / 2, rel=1e-3)
    assert f"{first['distance_m']:.0f}" in out


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "wheel_radius_m: 0.42",
            "wheel_radius_m: 0.84",
            "wheel radius = 0.84 m, usual is 0.25 to 0.7: is it the diameter?",
        ),
        ("rotating_mass_fraction: 0.06", "rotating_mass_fraction: 0", "rotating mass = 0 of the mass"),
        ("deceleration_mps2: 1.3", "deceleration_mps2: 2.6", "full brake = 2.6 m/s^2, usual is 0.15 to 1.6"),
        ("full_pressure_pa: 380.0e+3", "full_pressure_pa: 3800", "full pressure = 0.038 bar"),
        ("{empty: 170.0e+3, loaded: 250.0e+3}", "{empty: 17.0e+3, loaded: 25.0e+3}", "mass per length = 0.1944 t/m"),
        ("c2: 0.00026", "c2: 0.0099", "resistance at top speed = 65.21 N/kN"),
        (
            "deceleration_mps2: 1.3",
            "deceleration_mps2: 0.1",
            "adhesion that the full brake uses = 0.0102, usual is 0.015 to 0.1971: ",
        ),
        ("known_to: {mass: 0.1", "known_to: {mass: 10", "known_to mass = 10 of it, usual is 0.001 to 1: per cent?"),
        ("max_speed_kmh: 80", "max_speed_kmh: 400", "adhesion that the full brake uses"),
    ],
)
def test_what_is_unlikely_is_said_with_what_is_usual(
    old: str, new: str, said: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    text = (SHIPPED / "metro.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "my_train.yaml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    code, out, _ = told(capfd, "--check", str(path))
    assert code == 1
    assert f"unlikely: {said}" in out


def test_a_bad_file_is_bad_input(capfd: pytest.CaptureFixture[str]) -> None:
    code, out, err = told(capfd, "--check", "nowhere.yaml")
    assert (code, out) == (2, "")
    assert err.startswith("train: train = nowhere.yaml: not readable")


@pytest.mark.parametrize(
    "option",
    [
        *(("--output", "new.yaml"), ("--train", "metro"), ("--set", "train.mass_kg=1e5"), ("--params", "p.yaml")),
        *(("--seed", "1"), ("--node", "/a"), ("--remap", "/a:=position")),
    ],
)
def test_what_is_for_a_recording_is_refused_beside_check(
    option: tuple[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    said = f"train: {' '.join(option)}: is for --estimate: --check takes the train's file alone, leave this out\n"
    assert told(capfd, "--check", "metro", *option) == (2, "", said)


def test_a_seed_is_refused_where_nothing_is_drawn(capfd: pytest.CaptureFixture[str]) -> None:
    said = "train: --seed 1: nothing is drawn by chance: leave it out\n"
    assert told(capfd, "--estimate", "nowhere", "--seed", "1") == (2, "", said)


def test_a_file_of_something_else_is_not_printed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time,position\n" + "0.1,4.0\n" * 1000, encoding="utf-8")
    code, _, err = told(capfd, "--check", str(log))
    assert code == 2
    assert "give mass_kg, length_m" in err
    assert len(err) < 400


BRAKE, RESISTANCE = 0.85, 1.4
"""True over believed."""


def record(path: Path, seed: int = 1, *, slides: bool = False, coasts: bool = True) -> None:
    """Record two brakings of a metro train, coasting before them; its brake is weaker and its resistance higher."""
    rng, believed = np.random.default_rng(seed), read_train("metro").train
    full = believed.full_pressure_pa
    position, speed, dt = 0.0, 22.0, 0.1
    with BagWriter(path) as writer:
        for k in range(2200):
            t = k * dt
            pressure = full * (0.5 * (70.0 < t <= 95.0) + 1.0 * (185.0 < t <= 205.0))
            drives = 110.0 < t <= 120.0 or (not coasts and pressure == 0.0)
            resisting = RESISTANCE * G * float(believed.specific_resistance(np.array(speed)))
            brake = BRAKE * believed.brake_force(pressure) / believed.mass_kg
            brake = min(brake, 0.3) if slides and t > 180.0 else brake
            slowing = (brake + resisting) / (1.0 + believed.rotating_mass_fraction)
            speed = max(speed + dt * ((1.2 if t > 100.0 and coasts else 0.0) if drives else -slowing), 0.0)
            position += speed * dt
            t_ns = round(t * 1e9)
            noisy = 101_325.0 + pressure + float(rng.normal(0.0, 500.0))
            writer.write("/brake_pressure", BRAKE_PRESSURE.type, cdrs.brake_pressure(t_ns, noisy), t_ns)
            measured = position + float(rng.normal(0.0, 0.2))
            writer.write("/position", POSITION.type, cdrs.position(t_ns, measured, 0.04), t_ns)


def test_brake_and_resistance_are_found_where_it_coasts_and_brakes(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "a run\nof its own"
    record(run)
    proposal, result = tmp_path / "as found.yaml", tmp_path / "result.json"
    code, out, err = told(
        capfd,
        *("--estimate", str(run), "--train", "metro"),
        *("--output", str(proposal), "--json", str(result)),
    )
    assert code == 0, err
    found = json.loads(result.read_text(encoding="utf-8"))
    assert found["brake_ratio"]["mean"] == pytest.approx(BRAKE, abs=0.03)
    assert found["resistance_ratio"]["mean"] == pytest.approx(RESISTANCE, abs=0.1)
    assert found["deceleration_mps2"] == pytest.approx(1.3 * BRAKE, abs=0.04)
    assert "believed: metro, six cars" in out
    assert "not dry throughout" in out
    assert f"holds the proposal: train --check '{proposal}'\n" in out, "the command runs as it is printed"
    proposed = read_train(str(proposal))
    assert proposed.train.brake_force(380e3) == pytest.approx(
        BRAKE * read_train("metro").train.brake_force(380e3), rel=0.04
    )
    assert proposed.train.resistance_c0 == pytest.approx(1.2 * RESISTANCE, rel=0.08)
    again, _, refused = told(capfd, "--estimate", str(run), "--output", str(proposal))
    assert again == 2
    assert "is there already" in refused


def test_stretches_that_slid_are_left_out(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    record(tmp_path / "run", slides=True)
    result = tmp_path / "result.json"
    assert told(capfd, "--estimate", str(tmp_path / "run"), "--train", "metro", "--json", str(result))[0] == 0
    brake: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))["brake_ratio"]
    assert brake["mean"] == pytest.approx(BRAKE, abs=0.05)
    assert brake["left_out"] >= 2


def test_a_train_under_power_does_not_coast(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    record(tmp_path / "run", coasts=False)
    _, out, _ = told(capfd, "--estimate", str(tmp_path / "run"), "--train", "metro")
    assert "resistance   not found: nowhere does it coast for 20 s" in out


def test_a_recording_without_pressures_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with BagWriter(tmp_path / "run") as writer:
        writer.write("/position", POSITION.type, cdrs.position(0, 0.0, 0.04), 0)
    code, _, err = told(capfd, "--estimate", str(tmp_path / "run"))
    assert code == 2
    assert "holds no brake_pressure" in err
    assert err.rstrip().endswith(": record it, or import_csv --pressure COL")

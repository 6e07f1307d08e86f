# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train's file: what it gives the estimator, live and offline, the shipped ones, and every slip of the pen."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

import pytest
import yaml
from conftest import ROOT
from rclpy.context import Context
from rclpy.parameter import Parameter

from adhesion_node.core import Config
from adhesion_node.core.physics.train import CRH3
from adhesion_node.nodes import replay
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.tools.log.options import add_options, format_of
from adhesion_node.wire.files.train import GEOMETRY, SHIPPED, read_train
from adhesion_node.wire.settings.given import given
from adhesion_node.wire.settings.nodes import SETTINGS
from adhesion_node.wire.settings.setup import setup_of

UNIT: dict[str, Any] = {
    "name": "regional unit",
    "mass_kg": {"empty": 100e3, "loaded": 140e3},
    "load": 0.25,
    "length_m": 69,
    "wheel_radius_m": 0.42,
    "rotating_mass_fraction": 0.05,
    "brake": {"full_pressure_pa": 380e3, "build_up_s": 1.5, "deceleration_mps2": 1.2},
    "resistance": {"c0": 1.57, "c1": 0.0085, "c2": 0.0003},
    "known_to": {"mass": 0.08, "rotating_mass": 0.01},
}


def written(folder: Path, **changes: Any) -> str:
    """Write the unit's file with changes; None leaves a key out."""
    content = {key: value for key, value in {**UNIT, **changes}.items() if value is not None}
    path = folder / "unit.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return str(path)


def test_the_full_brake_gives_the_deceleration_at_the_load(tmp_path: Path) -> None:
    setup = setup_of({"train_file": written(tmp_path)})
    train, config = setup.config.train, setup.config
    assert train.mass_kg == 110e3
    assert train.brake_force(380e3) == pytest.approx(1.2 * 110e3 * 1.05)
    assert (train.length_m, train.wheel_radius_m, train.resistance_c2) == (69.0, 0.42, 0.0003)
    assert (config.brake_build_up_s, config.assumed_pressure_pa) == (1.5, 380e3)
    assert (config.mass_std, config.rotating_mass_std, config.brake_std) == (0.08, 0.01, Config().brake_std)
    assert setup.train == "regional unit: 110 t, 69 m, full brake 1.2 m/s^2"


def test_a_brake_by_its_geometry_is_that_of_the_paper() -> None:
    train = read_train("high_speed").train
    assert train.mass_kg == CRH3.mass_kg
    assert train.brake_force(410e3) == CRH3.brake_force(410e3)
    assert setup_of({}).train.startswith("CRH3 of Xie et al. 2019, as no train is given: 536 t")
    assert setup_of({"train.mass_kg": 4e5}).train.startswith("by its parameters: 400 t")


def test_what_is_given_beside_the_file_counts_first(tmp_path: Path) -> None:
    file = written(tmp_path)
    params = tmp_path / "params.yaml"
    params.write_text("/**: {ros__parameters: {mass_std: 0.2, train.length_m: 70.0}}", encoding="utf-8")
    options = Namespace(train=file, params=str(params), node=None, set=["train.mass_kg=536000.0"])
    config = setup_of(given(options, "estimator", SETTINGS)).config
    assert (config.train.mass_kg, config.train.length_m, config.mass_std) == (536e3, 70.0, 0.2)
    assert config.train.wheel_radius_m == 0.42


@pytest.mark.parametrize("name", ["high_speed", "metro", "freight"])
def test_the_shipped_trains_are_installed_and_read_by_name(name: str) -> None:
    assert (SHIPPED / f"{name}.yaml").is_file()
    found = read_train(name)
    assert found.values == read_train(str(SHIPPED / f"{name}.yaml")).values
    assert found.empty_kg <= found.train.mass_kg <= found.loaded_kg


def test_a_node_takes_the_file_and_shows_what_it_gives(context: Context, tmp_path: Path) -> None:
    overrides = [Parameter("train_file", value=written(tmp_path)), Parameter("train.length_m", value=70.0)]
    node = Estimator(context=context, parameter_overrides=overrides)
    try:
        assert node.config.train == setup_of({"train_file": written(tmp_path), "train.length_m": 70.0}).config.train
        assert node.get_parameter("train.mass_kg").value == 110e3
        assert node.get_parameter("train.length_m").value == 70.0
    finally:
        node.destroy_node()


def test_a_replay_says_for_which_train_it_was_computed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    bag, result = str(ROOT / "bags" / "tunnel_entry"), tmp_path / "result.json"
    assert replay.main([bag, "--offline", "--train", "metro", "--json", str(result)]) == 0
    first = capfd.readouterr().out.splitlines()[0].split(maxsplit=1)
    assert first == ["train", json.loads(result.read_text(encoding="utf-8"))["train"]]
    assert first[1] == "metro, six cars: 210 t, 108 m, full brake 1.3 m/s^2"


def test_an_import_takes_wheels_and_full_pressure_from_the_file(tmp_path: Path) -> None:
    parser = ArgumentParser()
    add_options(parser)
    file = written(tmp_path)
    formats = [format_of(parser.parse_args(args)) for args in ([], ["--train", file])]
    formats.append(format_of(parser.parse_args(["--train", file, "--wheel-radius", "0.4"])))
    assert [form.wheel_radius_m for form in formats] == [0.46, 0.42, 0.4]
    assert [form.full_pressure_pa for form in formats] == [410e3, 380e3, 380e3]


def test_a_key_that_stands_twice_is_refused(tmp_path: Path) -> None:
    """YAML takes the last one, without a word."""
    twice = tmp_path / "twice.yaml"
    twice.write_text(f"{Path(written(tmp_path)).read_text(encoding='utf-8')}\nlength_m: 50\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"twice\.yaml: not readable \(length_m stands in line \d+ once more"):
        read_train(str(twice))


BRAKE = UNIT["brake"]
SHARES = {"full_pressure_pa": 380e3, "build_up_s": 1.5, **dict.fromkeys(GEOMETRY, 0.5)}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lenght_m": 1.0}, "the file: lenght_m means nothing: did you mean length_m?"),
        ({"resistance": None}, "the file: resistance missing; doc/train.md has the format"),
        ({"mass_kg": "110 t"}, "load = 0.25: means nothing without mass_kg"),
        ({"mass_kg": "110 t", "load": None}, "mass_kg = '110 t': give a number"),
        ({"mass_kg": {"empty": 2e5, "loaded": 1e5}}, "give empty up to loaded, and a load from 0 to 1"),
        ({"load": 50}, "load = 50: give empty up to loaded, and a load from 0 to 1"),
        ({"length_m": -69}, "train.length_m = -69.0: give a value from 1 to 5000 m"),
        ({"rotating_mass_fraction": True}, "rotating_mass_fraction = True: give a number"),
        ({"brake": 1.2}, "brake = 1.2: give full_pressure_pa, build_up_s, deceleration_mps2"),
        ({"brake": {**BRAKE, "pads": 96}}, "brake: give deceleration_mps2, or else all of cylinder_diameter_m"),
        ({"brake": {"full_pressure_pa": 380e3, "build_up_s": 1.5}}, "brake: give deceleration_mps2, or else all of"),
        ({"brake": {**BRAKE, "deceleration_mps2": 120}}, r"deceleration_mps2 = 120: give 0.01 to 5 m/s\^2"),
        ({"brake": {**BRAKE, "full_pressure_pa": 3.8}}, "train.full_pressure_pa = 3.8: give a value from 1000"),
        ({"brake": {**SHARES, "pads": 96.5}}, "brake: pads = 96.5: give a whole number"),
        ({"length_m": 10**400}, "length_m = 10+[.]+0+: give a number"),
        ({"max_speed_kmh": -80}, "max_speed_kmh = -80: give a speed above 0 km/h"),
        ({"known_to": {"wheels": 0.1}}, "known_to: wheels means nothing: choose of mass, brake"),
    ],
)
def test_what_no_train_has_is_refused_by_key_value_and_remedy(
    changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    path = written(tmp_path, **changes)
    with pytest.raises(ValueError, match=rf"train = {path}: .*{message}"):
        read_train(path)


def test_an_empty_name_is_none(tmp_path: Path) -> None:
    """It was shown as None."""
    path = Path(written(tmp_path))
    path.write_text(path.read_text(encoding="utf-8").replace("name: regional unit", "name:"), encoding="utf-8")
    assert read_train(str(path)).name == "unit"


@pytest.mark.parametrize("text", ["[1, 2", "- 1", "", "a: &a [*a]"])
def test_what_is_no_such_file_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "unit.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"train = .*unit\.yaml: "):
        read_train(str(path))


def test_a_missing_file_names_those_that_are_there() -> None:
    with pytest.raises(ValueError, match=r"nowhere\.yaml: not readable .* or one of freight, high_speed, metro"):
        read_train("nowhere.yaml")

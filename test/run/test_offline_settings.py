# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Settings of the offline replay: from its options and from a parameter file as ROS reads it."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_offline import FAST, FAST_CONFIG, FAST_SETTINGS, START_NS, Offline, bag, offline, samples, straight

from adhesion_node.tools.defaults import text
from adhesion_node.wire.settings.setup import setup_of

__all__ = ["bag", "offline"]


def test_the_seed_changes_the_result(bag: Path, offline: Offline) -> None:
    one, two, again = (offline(bag, "--seed", seed).result for seed in ("1", "2", "1"))
    assert one["digest"] == again["digest"] == offline(bag).result["digest"] != two["digest"]
    assert two["mu_final"] == straight(samples(), FAST_CONFIG, 2)[-1].mu


def test_a_setting_is_used(bag: Path, offline: Offline) -> None:
    config = setup_of({**FAST, "window": 40}).config
    shorter = offline(bag, "--set", "window=40").result
    assert shorter["mu_final"] == straight(samples(), config)[-1].mu != straight(samples(), FAST_CONFIG)[-1].mu


def test_a_setting_of_another_method_is_told(bag: Path, offline: Offline, tmp_path: Path) -> None:
    told = offline(bag, "--set", "particles=50", "--set", "method=bank", fast=False).err
    assert "replay: particles = 50: method = bank does not read it, particle_em would" in told
    (tmp_path / "all.yaml").write_text(text(), encoding="utf-8")
    complete = offline(bag, "--params", str(tmp_path / "all.yaml"), fast=False)
    assert not any("does not read" in line for line in complete.err)


def test_the_resistance_is_not_the_adhesions(bag: Path, offline: Offline) -> None:
    """5 N/kN more of the same braking; by a method that draws nothing."""
    found = [
        offline(bag, "--set", "method=rail_condition", "--set", f"train.resistance_c0={c0}", fast=False).result
        for c0 in (0.79, 5.79)
    ]
    assert found[0]["mu_final"] - found[1]["mu_final"] == pytest.approx(0.005, rel=0.1)


PARAMS = """
{name}:
  ros__parameters:
    method: particle_em
    step: 10
    iterations: 3
    particles: 10
    confidence: 0.9
    seed: 7
    train:
      mass_kg: 500000
"""

SAME_AS_PARAMS = [*FAST_SETTINGS, "--set=confidence=0.9", "--set=train.mass_kg=500000", "--seed=7"]


@pytest.mark.parametrize("name", ["estimator", "/estimator", "/**"])
def test_a_parameter_file_is_used(name: str, tmp_path: Path, bag: Path, offline: Offline) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(PARAMS.format(name=name))
    assert (
        offline(bag, "--params", str(file), fast=False).result["digest"]
        == offline(bag, *SAME_AS_PARAMS, fast=False).result["digest"]
    )


def test_the_nearer_setting_wins(tmp_path: Path, bag: Path, offline: Offline) -> None:
    """Those of the node before those of all nodes, --set before the file, --seed before all."""
    file = tmp_path / "params.yaml"
    everyone = PARAMS.format(name="/**").replace("0.9", "0.6").replace("7", "8")
    file.write_text(everyone + PARAMS.format(name="estimator").replace("7", "9").replace("iterations: 3", ""))
    options = ["--params", str(file), "--seed", "7"]
    same = offline(bag, *SAME_AS_PARAMS, fast=False).result["digest"]
    assert offline(bag, *options, fast=False).result["digest"] == same
    low = offline(bag, *options, "--set", "confidence=0.6", fast=False).result
    assert low["digest"] != same
    assert low["mu_lower_final"] > offline(bag, *options, fast=False).result["mu_lower_final"]


@pytest.mark.parametrize("later", [False, True])
def test_a_map_of_later_trains_is_told(later: bool, tmp_path: Path, bag: Path, offline: Offline) -> None:
    """It was of no effect, and nothing said so."""
    first_ns = START_NS + 86_400 * 10**9 if later else START_NS
    columns = "place_m,length_m,t_ns,seen,mu,mu_std,used,mu_lower,speed_mps"
    (tmp_path / "rail.csv").write_text(f"{columns}\n0,100,{first_ns},1,,,0.1,0.1,30\n")
    err = offline(bag, "--set", f"rail_map={tmp_path / 'rail.csv'}", fast=False).err
    told = [line for line in err if line.startswith("replay: rail_map begins at")]
    assert [f"t_ns = {first_ns}, " in line for line in told] == [True] * later


@pytest.mark.parametrize("by", ["--params", "--set"])
@pytest.mark.parametrize("setting", ["train_file", "track_line", "rail_map"])
def test_no_result_takes_the_place_of_a_file_that_a_setting_names(
    setting: str, by: str, tmp_path: Path, bag: Path, offline: Offline, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was read, and then lost."""
    monkeypatch.chdir(tmp_path)
    Path("named").write_text("read")
    Path("params.yaml").write_text(f"estimator:\n  ros__parameters:\n    {setting}: {tmp_path / 'named'}\n")
    given = "params.yaml" if by == "--params" else f"{setting}=named"
    code, _, _, err = offline(bag, by, given, "--json", "named", fast=False)
    assert (code, err) == (2, ["replay: --json named: is read, and would be lost: name another file"])
    assert Path("named").read_text() == "read"


@pytest.mark.parametrize("given", [["--params", "params.yaml"], ["--set", "method=bank"]])
def test_another_value_may_be_the_name_of_a_result(
    given: list[str], tmp_path: Path, bag: Path, offline: Offline, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was said to be read."""
    monkeypatch.chdir(tmp_path)
    Path("bank").write_text("of an earlier call")
    Path("params.yaml").write_text("estimator:\n  ros__parameters:\n    method: bank\n")
    _, _, _, err = offline(bag, *given, "--json", "bank", fast=False)
    assert not any("would be lost" in line for line in err)


def test_a_setting_without_a_value_is_refused_by_its_name(tmp_path: Path, bag: Path, offline: Offline) -> None:
    """It was passed over, and the default held."""
    file = tmp_path / "params.yaml"
    file.write_text("estimator:\n  ros__parameters:\n    confidence: {}\n")
    code, _, _, err = offline(bag, "--params", str(file), fast=False)
    assert (code, err) == (2, ["replay: confidence = {}: give a value of type float (a value from 0.5 to 0.9999)"])


def test_other_nodes_in_the_parameter_file_are_left_alone(tmp_path: Path, bag: Path, offline: Offline) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(PARAMS.format(name="estimator") + "simulator:\n  ros__parameters:\n    scenario: cruise\n")
    assert offline(bag, "--params", str(file), fast=False).code == 0


@pytest.mark.parametrize("name", ["estimator", "/**"])
def test_what_every_ros_node_understands_may_stand_in_the_file(
    name: str, tmp_path: Path, bag: Path, offline: Offline
) -> None:
    """The file of a live estimator: it follows /clock and subscribes reliably."""
    file = tmp_path / "params.yaml"
    file.write_text(
        PARAMS.format(name=name)
        + "    use_sim_time: true\n"
        + "    qos_overrides:\n      /position:\n        subscription:\n          reliability: reliable\n"
    )
    code, result, _, err = offline(bag, "--params", str(file), fast=False)
    assert (code, err) == (0, [])
    assert result["digest"] == offline(bag, *SAME_AS_PARAMS, fast=False).result["digest"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a readable ROS parameter file: it is to hold, one in the other, NODE: ros__parameters: NAME: VALUE"),
        ("a: [1", "not a readable ROS parameter file: line 1: "),
        ("5", "not a readable ROS parameter file"),
        ("estimator:\n  window: 40\n", "not a readable ROS parameter file"),
        ("simulator:\n  ros__parameters:\n    seed: 1\n", "has simulator: name the node 'estimator' or '/**'"),
        ("estimator:\n  ros__parameters:\n    windw: 40\n", "setting windw = 40: there is none; choose of "),
        ("estimator:\n  ros__parameters:\n    window: forty\n", "window = 'forty': give a value of type int"),
        ("estimator:\n  ros__parameters:\n    window: 2\n", "window = 2: give a value from 3 to 10000"),
        ("estimator:\n  ros__parameters:\n    seed: one\n", "seed = 'one': give "),
        ("estimator:\n  ros__parameters:\n    seed: 1.5\n", "seed = 1.5: give "),
        ("estimator:\n  ros__parameters:\n    frame: 5\n", "frame = 5: give "),
        ("estimator:\n  ros__parameters:\n", "params = "),  # refused by ROS, too
        ("estimator:\n  ros__parameters: 5\n", "params = "),
        ("estimator:\n  ros__parameters: [1, 2]\n", "params = "),
    ],
)
def test_a_bad_parameter_file_is_one_line_and_code_2(
    text: str, message: str, tmp_path: Path, bag: Path, offline: Offline
) -> None:
    (tmp_path / "params.yaml").write_text(text)
    code, _, out, (line,) = offline(bag, "--params", str(tmp_path / "params.yaml"), fast=False)
    assert (code, out) == (2, "")
    assert message in line

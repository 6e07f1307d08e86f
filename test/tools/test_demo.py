# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The demo on a scenario cut short: live equals offline, what it leaves behind, and its words."""

from __future__ import annotations

import json
import os
import shlex
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from matplotlib.image import imread
from rclpy.executors import SingleThreadedExecutor
from test_recording_survives import assert_complete, file_size_limit

from adhesion_node.bag import BagReader
from adhesion_node.bag.write import part
from adhesion_node.bag.write.writer import file_name
from adhesion_node.core import Estimate
from adhesion_node.core.physics.adhesion import DRY, WET
from adhesion_node.core.physics.track import LEVEL
from adhesion_node.nodes import replay
from adhesion_node.report import __main__ as report
from adhesion_node.tools.demo import __main__ as demo
from adhesion_node.tools.demo import line, staged
from adhesion_node.tools.demo.line import executor_of_line
from adhesion_node.wire.topics import ATP_STATUS, BRAKE_PRESSURE, DIAGNOSTICS, POSITION, RESULTS, TRUTH_MU, TRUTH_STATE
from sim_node.nodes import simulator
from sim_node.real.plant.scenarios import SCENARIOS as REAL
from sim_node.train import scenario
from sim_node.train.scenario import SCENARIOS, Brake, Rail

CRUISE_S, END_S = 4.0, 9.0
SAMPLES = 91
TASK = line.Task(1, {"scenario": "tunnel_entry"}, {"target_position_m": 8000.0, "target_speed_kmh": 100.0})


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Brake on wet rail from 4 s, end at 9 s: tunnel_entry would take half a minute."""
    full = SCENARIOS["tunnel_entry"]
    rail = Rail(((0.0, DRY), (full.speed_mps * (CRUISE_S - 0.05), WET)))
    cut = replace(full, rail=rail, brake=Brake(CRUISE_S), track=LEVEL, end_s=END_S)
    for module in (scenario, demo, staged):
        monkeypatch.setattr(module, "SCENARIOS", {**SCENARIOS, "tunnel_entry": cut})


@pytest.fixture
def run_demo(tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """Return a function that runs the demo into `tmp_path/demo` and returns its result."""

    def _run(*options: str) -> dict[str, Any]:
        file = tmp_path / "result.json"
        assert demo.main(["--output", str(tmp_path / "demo"), "--json", str(file), *options]) == 0
        result: dict[str, Any] = json.loads(file.read_text())
        return result

    return _run


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the picture, which takes a second, where the test is of something else."""
    monkeypatch.setattr(demo, "draw", lambda *_: None)


@pytest.fixture
def short_metro(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the metro on leaves brake from 22 km/h."""
    slow = replace(REAL["metro_leaves"], speed_mps=6.0, demands=((3.0, 1.0),))
    for module in (simulator, demo, staged):
        monkeypatch.setattr(module, "REAL", {"metro_leaves": slow})


def test_the_demo_leaves_a_recording_a_picture_and_the_same_numbers_as_offline(
    tmp_path: Path, run_demo: Callable[..., dict[str, Any]], capfd: pytest.CaptureFixture[str]
) -> None:
    result = run_demo("--seed", "3")
    out, err = capfd.readouterr()
    assert result["live_equals_offline"] is True
    assert result["live_digest"] == result["digest"]
    assert (result["measurements"], result["accepted"], result["dropped"]) == (SAMPLES, SAMPLES, {})
    assert result["windows"] >= 4
    assert result["regime_final"] in ("ADHESION_LIMITED", "COASTING")  # 5 s of braking tell little of what limits
    assert result["mu_final"] == pytest.approx(0.0726 + 0.002, abs=0.02)  # wet at 280 km/h
    assert Path(result["bag"]) == tmp_path / "demo" / "bag"
    _check_bag(Path(result["bag"]))
    assert imread(result["picture"]).shape[:2] == (1320, 1210)
    assert Path(result["picture"]).parent == tmp_path / "demo"
    assert result["atp"].split(" > ")[0] in {"EMERGENCY_BRAKE", "NORMAL"}
    assert "to the last bit" in out
    assert "adhesion coefficient" in out
    assert "what limits" in err.splitlines()[0]
    assert "nothing is claimed" in err.splitlines()[1], "the first estimate is of a train that cruises"
    assert "Traceback" not in err

    assert digest_of_what_it_says(out, tmp_path) == result["live_digest"]


def digest_of_what_it_says(out: str, folder: Path) -> str:
    """The digest of the offline replay by the command that a demo prints."""
    (command,) = [line for line in out.splitlines() if line.startswith("  replay ")]
    replay.main([*shlex.split(command)[1:], "--json", str(folder / "again.json")])  # a short run may identify nothing
    again: str = json.loads((folder / "again.json").read_text())["digest"]
    return again


def _check_bag(path: Path) -> None:
    """The sensors, the truth and every result are there, whole and with all their messages."""
    with BagReader(path) as reader:
        counts = {name.lstrip("/"): count for name, count in reader.counts.items()}
        assert reader.complete
        assert sum(1 for _ in reader.messages()) == sum(counts.values())
    estimates = (SAMPLES + 4) // 5
    assert counts.pop(ATP_STATUS.name) >= 1
    assert counts.pop(DIAGNOSTICS.name.lstrip("/")) > estimates, "the monitor speaks of its changes, too"
    assert counts == {
        **{topic.name: SAMPLES for topic in (POSITION, BRAKE_PRESSURE, TRUTH_STATE, TRUTH_MU)},
        **{topic.name.lstrip("/"): estimates for topic in RESULTS},
    }


@pytest.mark.parametrize(("name", "told"), [("tunnel_entry", {"track": staged.LEVEL}), ("grade_unknown", {})])
def test_a_line_is_told_to_be_level_unless_it_is_not(name: str, told: dict[str, str], tmp_path: Path) -> None:
    assert staged.task_of(name, "", 1, tmp_path).estimator == told
    assert ("track" in (tmp_path / staged.PARAMS).read_text()) is bool(told)


@pytest.mark.parametrize("sensors", ["fix", "full"])
def test_a_real_train_too_gives_the_same_numbers_as_offline_and_shows_what_was_known_when(
    sensors: str,
    tmp_path: Path,
    short_metro: None,
    run_demo: Callable[..., dict[str, Any]],
    capfd: pytest.CaptureFixture[str],
) -> None:
    result = run_demo("--scenario", "metro_leaves", "--sensors", sensors)
    out, _ = capfd.readouterr()
    assert result["live_equals_offline"] is True
    assert result["measurements"] > 200
    assert 3.0 < result["limited_from_s"] < 6.0
    assert f"adhesion limits from {result['limited_from_s']:.1f} s on, told {result['told_after_s']:.1f} s later" in out
    assert result["mean_relative_error_percent"] > 0.0  # of today's estimator; how good it is is not the matter here
    assert imread(result["picture"]).shape[:2] == (1320, 1210)
    left = {path.name for path in Path(result["picture"]).parent.iterdir()}
    assert left == {"bag", "params.yaml", "run.png"} | ({"track.geojson"} if sensors == "fix" else set())
    assert digest_of_what_it_says(out, tmp_path) == result["live_digest"]
    again = json.loads((tmp_path / "again.json").read_text())
    assert again["mean_relative_error_percent"] == result["mean_relative_error_percent"]
    report.main([result["bag"], "--output", str(tmp_path / "page"), "--json", str(tmp_path / "report.json")])
    (run,) = json.loads((tmp_path / "report.json").read_text())["runs"]
    assert run["mean_relative_error_percent"] == pytest.approx(result["mean_relative_error_percent"], rel=1e-9)


def test_the_first_curves_may_come_all_at_once(
    short_metro: None, run_demo: Callable[..., dict[str, Any]], undrawn: None
) -> None:
    """Without a position the first estimates wait for 3 s; the demo took the curves between for lost, and ended."""
    result = run_demo("--scenario", "metro_leaves", "--sensors", "doppler_only")
    assert result["live_equals_offline"] is True
    assert result["measurements"] == 0


def test_where_ros_cannot_start_it_is_said_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As for a user without a home, for whom it has no folder for its log."""

    def fails(**_: Any) -> None:
        raise RuntimeError("failed to get the log directory")

    monkeypatch.setattr("rclpy.init", fails)
    assert demo.main(["--output", str(tmp_path / "demo")]) == 2
    assert capsys.readouterr().err == "demo: ROS does not start: failed to get the log directory\n"


def test_equal_runs_leave_equal_bytes_however_busy_the_machine_is(tmp_path: Path) -> None:
    """The second run is held up for longer than any watchdog waits: 2 s."""
    bags = [tmp_path / "one", tmp_path / "two"]
    for bag, busy_s in zip(bags, (0.0, 2.5), strict=True):
        with executor_of_line() as executor:
            line.play(executor, TASK, bag, partial(_hold_up, executor, busy_s))
    first, second = [{file.name: file.read_bytes() for file in bag.iterdir()} for bag in bags]
    assert _statuses(bags[0]) == _statuses(bags[1])
    assert first == second


def _hold_up(executor: SingleThreadedExecutor, busy_s: float, at_s: float, _: Estimate | None) -> bool:
    """At one sample let everything but the simulator go on for so long."""
    until = time.monotonic() + busy_s
    while at_s == 6.1 and time.monotonic() < until:
        executor.spin_once(timeout_sec=0.1)
    return True


def _statuses(bag: Path) -> list[tuple[int, str, str]]:
    with BagReader(bag) as reader:
        return [
            (record.log_ns, record.topic, str(record.message))
            for record in reader.messages(["/atp/status", "/diagnostics"])
        ]


@pytest.mark.usefixtures("undrawn")
def test_a_folder_that_is_taken_is_left_alone(tmp_path: Path, run_demo: Callable[..., dict[str, Any]]) -> None:
    for name in ("demo", "demo_2"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.txt").write_text("keep")
    result = run_demo()
    assert Path(result["bag"]) == tmp_path / "demo_3" / "bag"
    for name in ("demo", "demo_2"):
        assert [path.name for path in (tmp_path / name).iterdir()] == ["mine.txt"]


@pytest.mark.usefixtures("undrawn")
def test_two_at_once_take_two_folders(
    tmp_path: Path, run_demo: Callable[..., dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen_as_free = {tmp_path / "demo"}  # by this one, while another takes it
    exists = Path.exists
    monkeypatch.setattr(Path, "exists", lambda path: path not in seen_as_free and exists(path))
    (tmp_path / "demo").mkdir()
    assert Path(run_demo()["bag"]) == tmp_path / "demo_2" / "bag"


@pytest.mark.usefixtures("undrawn")
def test_its_folder_may_be_read_by_whom_the_umask_lets(tmp_path: Path, run_demo: Callable[..., dict[str, Any]]) -> None:
    before = os.umask(0o027)
    try:
        run_demo()
    finally:
        os.umask(before)
    assert (tmp_path / "demo").stat().st_mode & 0o777 == 0o750


@pytest.mark.usefixtures("undrawn")
def test_one_scenario_shows_every_level_of_the_supervision(run_demo: Callable[..., dict[str, Any]]) -> None:
    told = run_demo("--scenario", "approach")["atp"].split(" > ")
    once = list(dict.fromkeys(told[1:]))  # before the first pair of state and curve no distance is safe
    assert once == ["NORMAL", "INDICATION", "OVERSPEED", "WARNING", "SERVICE_BRAKE", "EMERGENCY_BRAKE"]
    assert told[-1] == "NORMAL", "the brake has made up for it"


def test_bad_usage_ends_with_code_2(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        demo.main(["--scenario", "avalanche"])
    assert ended.value.code == 2
    err = capsys.readouterr().err
    assert "'avalanche'" in err
    assert "tunnel_exit" in err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--sensors", "full"], "demo: --sensors full: tunnel_entry has its own: leave them out, or choose a scenario"),
        (["--port", "8080"], "demo: --port 8080: there is no page without --live"),
        (["--port", "9000"], "demo: --port 9000: there is no page without --live"),
        (["--host", "0.0.0.0"], "demo: --host 0.0.0.0: there is no page without --live"),
    ],
)
def test_an_option_that_means_nothing_is_one_line_and_code_2_and_leaves_nothing(
    options: list[str], said: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert demo.main(["--output", str(tmp_path / "demo"), *options]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith(said)
    assert not (tmp_path / "demo").exists()


@pytest.mark.parametrize("seed", [-1, 2**31, 2**63])
def test_a_bad_seed_is_one_line_and_code_2_and_leaves_nothing(
    seed: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Of more than 64 bits ROS ends in a traceback."""
    assert demo.main(["--output", str(tmp_path / "demo"), "--seed", str(seed)]) == 2
    out, err = capfd.readouterr()
    (line,) = err.splitlines()
    assert out == ""
    assert line.startswith(f"demo: seed = {seed}: give ")
    assert not (tmp_path / "demo").exists()


def test_a_full_disk_is_one_line_and_code_1_and_the_recording_complete_up_to_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(part, "STEP_BYTES", 4096)  # more would hold all of this short run
    with file_size_limit(150_000):
        assert demo.main(["--output", str(tmp_path / "demo")]) == 1
    last = capfd.readouterr().err.splitlines()[-1]
    bag = tmp_path / "demo" / "bag"
    assert last == f"demo: {bag / file_name(0)}: File too large: the recording ends here, make room for another"
    with BagReader(bag) as reader:
        messages = sum(reader.counts.values())
        assert 30 < reader.counts["/position"] < SAMPLES
    assert_complete(bag, messages)


def test_an_output_that_cannot_be_is_one_line_and_code_1(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert demo.main(["--output", str(tmp_path / "file" / "demo")]) == 1
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("demo: ")
    assert "Not a directory" in line

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Recordings and command lines that the offline replay cannot use: told in one line, with the remedy."""

from __future__ import annotations

from pathlib import Path

import cdrs
import pytest
from recorded import JSON, PROTOBUF, write_beside
from test_offline import (
    FAST_CONFIG,
    KEYS,
    NO_TRUTH,
    START_NS,
    TRUTH_AND_SENSORS,
    Offline,
    bag,
    in_frame,
    offline,
    samples,
    straight,
    write_run,
)

from adhesion_node.bag import BagWriter, deserialize, encode, serialize
from adhesion_node.nodes import replay
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_PRESSURE, FIX, POSITION, SPEED

__all__ = ["bag", "offline"]


def test_a_falling_chainage_is_run_as_a_rising_one_or_told(tmp_path: Path, bag: Path, offline: Offline) -> None:
    def mirrored(topic: Topic, _index: int, cdr: bytes) -> bytes:
        if topic is not POSITION:
            return cdr
        message = deserialize(cdr, topic.type)
        message.pose.pose.position.x *= -1.0
        return serialize(message, topic.type)

    write_run(tmp_path / "down", samples(), edit=mirrored)
    rows = tmp_path / "rows.csv"
    down = offline(tmp_path / "down", "--set", "direction=down", "--out", str(rows))
    assert down.result["digest"] == offline(bag).result["digest"]
    assert "back_m" not in down.result
    assert float(rows.read_text().splitlines()[-1].split(",")[1]) < -1000.0, "the chainage, as it was given"
    unannounced = offline(tmp_path / "down")
    assert unannounced.result["back_m"] > 500.0
    assert any("set direction to what the chainage does along the run" in line for line in unannounced.err)


def test_positions_that_are_held_are_as_good_as_they_are_many(tmp_path: Path, offline: Offline) -> None:
    """One position in a second, written ten times."""
    held = [samples(10.0)[index - index % 10][1].position_m for index in range(len(samples(10.0)))]

    def sampled(topic: Topic, index: int, cdr: bytes) -> bytes:
        if topic is not POSITION:
            return cdr
        message = deserialize(cdr, topic.type)
        message.pose.pose.position.x = held[index]
        return serialize(message, topic.type)

    write_run(tmp_path / "held", samples(10.0), edit=sampled, names=NO_TRUTH)
    said = offline(tmp_path / "held")
    assert "back_m" not in said.result
    assert said.result["dropped"]["HELD"] > 0.8 * said.result["measurements"]
    assert "why" not in said.result


def test_a_brake_that_is_not_the_trains_is_told(tmp_path: Path, bag: Path, offline: Offline) -> None:
    """One that is told to have more than twice its mass brakes more than twice as hard as its papers promise."""
    heavy, right = (offline(bag, "--set", f"train.mass_kg={mass}") for mass in (1.2e6, 536e3))
    (said,) = [line for line in heavy.err if "its full brake gives" in line]
    assert "check the units of speed and pressure, and the train (--train)" in said
    assert not any("brake gives" in line for line in right.err)


def test_a_track_that_lies_elsewhere_is_told(bag: Path, offline: Offline) -> None:
    told = [
        offline(bag, "--set", f"track=grade {at}").err for at in ("1000 9000 10", "100000 120000 10", "-900 -800 1")
    ]
    off = [[line for line in err if "no section of the track is where the train ran" in line] for err in told]
    assert off[0] == []
    assert " m ahead of it" in off[1][0]
    assert " m behind it" in off[2][0]


def test_a_wrong_frame_is_counted_or_accepted_by_name(tmp_path: Path, bag: Path, offline: Offline) -> None:
    write_run(tmp_path / "map", samples(), edit=lambda topic, _, cdr: in_map(topic, cdr))
    code, result, *_ = offline(tmp_path / "map", "--set", "frame=map")
    assert (code, result["dropped"]) == (0, {})
    assert result["digest"] == offline(bag).result["digest"]
    code, result, *_ = offline(tmp_path / "map")
    assert code == 1
    assert result["dropped"] == {"WRONG_FRAME": 180}
    assert (result["measurements"], result["accepted"]) == (180, 0)


def in_map(topic: Topic, cdr: bytes) -> bytes:
    return in_frame("map", cdr, topic) if topic in (POSITION, BRAKE_PRESSURE) else cdr


def test_a_few_bad_messages_are_counted_and_change_nothing(tmp_path: Path, offline: Offline) -> None:
    """As if they were not there: NaN, a negative variance, another frame, a gauge pressure."""

    def spoil(topic: Topic, index: int, cdr: bytes) -> bytes:
        t_ns = START_NS + samples_[index][0].t_ns
        if topic is POSITION and index == 20:
            return cdrs.position(t_ns, float("nan"), 0.25)
        if topic is POSITION and index in (40, 41):
            return cdrs.position(t_ns, 1.0, -1.0)
        if topic is POSITION and index == 60:
            return in_frame("", cdr, topic)
        if topic is BRAKE_PRESSURE and index == 10:
            return cdrs.brake_pressure(t_ns, 0.0)
        return cdr

    samples_ = samples()
    write_run(tmp_path / "spoilt", samples_, edit=spoil)
    result = offline(tmp_path / "spoilt").result
    reasons = {"NOT_FINITE": 1, "BAD_VARIANCE": 2, "WRONG_FRAME": 1, "IMPLAUSIBLE_PRESSURE": 1}
    assert result["dropped"] == reasons
    assert (result["measurements"], result["accepted"]) == (180, 176)
    kept = [sample for index, sample in enumerate(samples_) if index not in (20, 40, 41, 60)]
    assert result["mu_final"] == straight(kept, FAST_CONFIG)[-1].mu


def test_a_bag_without_any_estimate_has_failed(tmp_path: Path, offline: Offline) -> None:
    def no_variance(topic: Topic, _: int, cdr: bytes) -> bytes:
        return cdrs.position(START_NS, 1.0, -1.0) if topic is POSITION else cdr

    write_run(tmp_path / "bad", samples()[:20], edit=no_variance)
    code, result, _, err = offline(tmp_path / "bad")
    dropped, why = err
    said = "BAD_VARIANCE: position: position covariance[0] = -1: give covariance[0] in SI units squared"
    assert dropped.startswith(f"replay: 20 messages were dropped: {said}"), "the thing, its value and the remedy"
    assert (code, why) == (1, f"replay: nothing is identified: {result['why']}")
    assert result["why"] == "no estimate came of it; see what was dropped, and why, or is it too short?"
    assert set(result) == KEYS | {"why"}
    assert (result["measurements"], result["accepted"], result["dropped"]) == (20, 0, {"BAD_VARIANCE": 20})
    assert [result[key] for key in ("mu_final", "mu_lower_final", "regime_final", "windows")] == [None, None, None, 0]


def write_fixes(path: Path, count: int, beside: Topic) -> None:
    """Record a speed or a position, and as many fixes."""
    with BagWriter(path) as writer:
        for index in range(100):
            t_ns = START_NS + index * 10**8
            writer.write(f"/{BRAKE_PRESSURE.name}", BRAKE_PRESSURE.type, cdrs.brake_pressure(t_ns, 101_325.0), t_ns)
            value = 40.0 if beside is SPEED else 4.0 * index
            writer.write(f"/{beside.name}", beside.type, encode(beside, t_ns, (value,), 0.25), t_ns)
            if index < count:
                writer.write(f"/{FIX.name}", FIX.type, encode(FIX, t_ns, (47.0 + 4e-5 * index, 8.0, 500.0), 1.0), t_ns)


@pytest.mark.parametrize(("count", "beside"), [(100, SPEED), (100, POSITION), (3, POSITION)])
def test_fixes_without_a_track_line_are_told(count: int, beside: Topic, tmp_path: Path, offline: Offline) -> None:
    write_fixes(tmp_path / "fixes", count, beside)
    write_fixes(tmp_path / "none", 0, beside)
    told, without = offline(tmp_path / "fixes"), offline(tmp_path / "none")
    remedy = (
        "NO_TRACK_LINE: fix: track_line = '': set track_line to a GeoJSON or CSV file with the centre line of the track"
    )
    assert f"replay: {count} fixes were dropped: {remedy}" in told.err
    assert told.result["dropped"] == {**without.result["dropped"], "NO_TRACK_LINE": count}
    assert told.result["measurements"] == without.result["measurements"] + count
    assert told.result["digest"] == without.result["digest"]
    assert not any("fixes" in line for line in without.err)


def test_fixes_that_are_not_wanted_are_not_missed(tmp_path: Path, offline: Offline) -> None:
    write_fixes(tmp_path / "fixes", 100, POSITION)
    named = offline(tmp_path / "fixes", "--set", "position_source=position")
    assert (named.result["measurements"], named.result["dropped"]) == (100, {})
    off = offline(tmp_path / "fixes", "--set", "use_fix=false")
    assert off.result["dropped"] == {"SWITCHED_OFF": 100}


def test_the_only_train_is_replayed_whatever_its_namespace(bag: Path, tmp_path: Path, offline: Offline) -> None:
    names = {topic: f"/train7/{topic.name}" for topic in TRUTH_AND_SENSORS}
    write_run(tmp_path / "seventh", samples(), names=names)
    own, seventh = offline(bag).result, offline(tmp_path / "seventh").result
    unlike = ("ms_per_window_p50", "ms_per_window_p99")
    assert [{key: value for key, value in each.items() if key not in unlike} for each in (own, seventh)] == [
        {key: value for key, value in own.items() if key not in unlike}
    ] * 2
    mended = offline(tmp_path / "seventh", "--remap", "/train7/position:=position").result
    assert mended["digest"] == own["digest"]


def test_a_bag_without_position_says_what_there_is(tmp_path: Path, offline: Offline) -> None:
    write_run(tmp_path / "other", samples()[:3], names={POSITION: "/gnss/position", **NO_TRUTH})
    code, result, out, (line,) = offline(tmp_path / "other")
    assert (code, result, out) == (2, None, "")
    assert "topic position: not in the recording. It holds: /brake_pressure (" in line
    assert line.endswith("for instance --remap /gnss/position:=position")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--set", "windw=40"], "setting 'windw=40': did you mean window=VALUE?"),
        (["--set", "window=forty"], "setting window = 'forty': give a value of type int"),
        (["--set", "window=2"], "window = 2: give a value from 3 to 10000"),
        (["--set", "window=10"], "step = 10: choose less than the window, 10"),
        (["--set", "train.mass_kg=nan"], "train.mass_kg = nan: give a value from 1000 to 1e+08 kg"),
        (["--set", "low_adhesion=ice"], "low_adhesion = 'ice': choose one of "),
        (["--set", "track=tunnel 0"], "track section 'tunnel 0': write 'grade START END RISE'"),
        (["--seed", "-1"], "seed = -1: give a value from 0 to 2147483647"),
        (["--seed", "3000000000"], "seed = 3000000000: give "),
        (["--remap", "position"], "remap = 'position': write FROM:=TO"),
        (["--remap", "/nothing:=position"], "remap from /nothing: not in the recording. It holds: "),
        (["--topics", "wheel_speed"], "topic wheel_speed: not in the recording"),
        (["--params", "/nowhere/params.yaml"], "params = /nowhere/params.yaml: not a readable ROS parameter file"),
    ],
)
def test_bad_input_is_one_line_and_code_2(bag: Path, options: list[str], message: str, offline: Offline) -> None:
    code, result, out, (line,) = offline(bag, *options)
    assert (code, result, out) == (2, None, "")
    assert line.startswith("replay: ")
    assert message in line


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "does not exist: name a rosbag2 directory or an .mcap file"),
        (b"", "is empty: name another recording"),
        (b"garbage", "is not an MCAP file: name another recording"),
        (b"\x89MCAP0\r\n", "holds no readable message ("),
    ],
)
def test_an_unreadable_bag_is_one_line_and_code_2(
    content: bytes | None, message: str, tmp_path: Path, offline: Offline
) -> None:
    if content is not None:
        (tmp_path / "x.mcap").write_bytes(content)
    code, result, out, (line,) = offline(tmp_path / "x.mcap")
    assert (code, result, out) == (2, None, "")
    assert line.startswith("replay: ")
    assert "x.mcap" in line
    assert message in line


def test_what_is_no_cdr_beside_the_sensors_is_told_and_changes_nothing(tmp_path: Path, offline: Offline) -> None:
    alone, beside = (
        offline(write_beside(tmp_path / f"{len(others)}.mcap", *others, steps=300)) for others in ((), (PROTOBUF,))
    )
    assert (alone.result["measurements"], alone.result["digest"]) == (300, beside.result["digest"])
    told = "replay: topic /log: encoding = 'protobuf': only CDR (ROS 2) is read: 2 messages are left out"
    assert beside.err == [told, *alone.err]


def test_a_sensor_that_is_no_cdr_is_refused(tmp_path: Path, offline: Offline) -> None:
    code, result, out, (line,) = offline(write_beside(tmp_path / "x.mcap", JSON._replace(topic="/speed")))
    assert (code, result, out) == (2, None, "")
    assert line.endswith("only CDR (ROS 2) is read: convert it, or leave it out by --remap /speed:=unused")


def test_bad_usage_ends_with_code_2(bag: Path, capfd: pytest.CaptureFixture[str]) -> None:
    offline = str(bag), "--offline"
    for arguments in (["--offline"], [*offline, "--nothing"], [*offline, "--seed", "one"], [str(bag), "--off"]):
        with pytest.raises(SystemExit) as ended:
            replay.main(arguments)
        assert ended.value.code == 2
    assert "Traceback" not in capfd.readouterr().err

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`replay --offline`: what it reports, that it repeats itself to the bit, and every kind of bad input."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import cdrs
import messages
import numpy as np
import pytest
from conftest import ROOT
from rclpy.serialization import serialize_message

from adhesion_node.bag import BagReader, BagWriter, deserialize, serialize
from adhesion_node.bag.writer import file_name
from adhesion_node.command import options as cli
from adhesion_node.core import Config, Estimate, Measurement, finish, init, step
from adhesion_node.nodes import replay
from adhesion_node.wire.settings import setup_of
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION, TRUTH_MU, TRUTH_STATE, Topic
from sim_node.train.plant import Truth
from sim_node.train.run import run
from sim_node.train.scenario import find
from sim_node.train.sensors import Reading

S = 10**9
START_NS = 1_700_000_000 * S
"""Stamp of the scenario's begin."""

FAST = {"method": "particle_em", "step": 10, "iterations": 3, "particles": 10}
"""EM that is quick rather than good."""

FAST_CONFIG = setup_of(FAST).config
FAST_SETTINGS = [f"--set={name}={value}" for name, value in FAST.items()]

KEYS = {
    "train",
    "measurements",
    "accepted",
    "ticks",
    "dropped",
    "windows",
    "mu_final",
    "mu_lower_final",
    "regime_final",
    "digest",
}
"""Of the result, as other programs rely on; with the truth also `ERROR`."""

ERROR = "mean_relative_error_percent"

Edit = Callable[[Topic, int, bytes], bytes]


Sample = tuple[Truth, Reading]


@cache
def samples(begin_s: float = 15.0, end_s: float = 33.0) -> Sequence[Sample]:
    """Return a part of tunnel_entry; the brake comes on at 20 s."""
    return [sample for sample in run(find("tunnel_entry"), 0.1, 1) if begin_s * S <= sample[0].t_ns < round(end_s * S)]


def encoded(truth: Truth, reading: Reading) -> Iterator[tuple[Topic, bytes]]:
    """Yield the messages of a sample; the truth through the type store, so that equal runs give equal bytes."""
    t_ns = START_NS + truth.t_ns
    for topic, message in (
        (TRUTH_STATE, messages.state_message(t_ns, truth.position_m, 0.0, truth.speed_mps, 0.0)),
        (TRUTH_MU, messages.mu_message(truth.mu)),
    ):
        yield topic, serialize(deserialize(serialize_message(message), topic.type), topic.type)
    yield BRAKE_PRESSURE, cdrs.brake_pressure(t_ns, reading.pressure_pa)
    assert reading.position_m is not None
    yield POSITION, cdrs.position(t_ns, reading.position_m, 0.25)


def write_run(
    path: Path,
    run_: Sequence[Sample],
    *,
    names: Mapping[Topic, str | None] | None = None,
    edit: Edit = lambda topic, index, cdr: cdr,
) -> list[int]:
    """Record a run; the sizes of the file after each sample.

    `names` calls topics otherwise, or leaves them out (None); `edit` changes the bytes of a sample's message.
    """
    sizes = []
    with BagWriter(path) as writer:
        for index, (truth, reading) in enumerate(run_):
            for topic, cdr in encoded(truth, reading):
                name = (names or {}).get(topic, f"/{topic.name}")
                if name is not None:
                    writer.write(name, topic.type, edit(topic, index, cdr), START_NS + truth.t_ns)
            writer.flush()
            sizes.append(len((path / file_name(0)).read_bytes().rstrip(b"\0")))
    return sizes


TRUTH_AND_SENSORS = (TRUTH_STATE, TRUTH_MU, BRAKE_PRESSURE, POSITION)

NO_TRUTH: Mapping[Topic, str | None] = {TRUTH_STATE: None, TRUTH_MU: None}


def in_frame(frame: str, cdr: bytes, topic: Topic) -> bytes:
    message = deserialize(cdr, topic.type)
    message.header.frame_id = frame
    return serialize(message, topic.type)


class Outcome(NamedTuple):
    """What a call of the program left."""

    code: int
    result: Any
    out: str
    err: list[str]


Offline = Callable[..., Outcome]


@pytest.fixture
def offline(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Offline:
    """Return a function that runs `replay BAG --offline` with quick settings.

    It gives no sign of life on standard error: how many there are would depend on the machine's speed.
    """
    monkeypatch.setattr(cli, "PROGRESS_S", math.inf)

    def _offline(bag: Path, *options: str, fast: bool = True) -> Outcome:
        file = tmp_path / "result.json"
        file.unlink(missing_ok=True)
        capfd.readouterr()
        code = replay.main([str(bag), "--offline", *(FAST_SETTINGS if fast else []), "--json", str(file), *options])
        out, err = capfd.readouterr()
        return Outcome(code, json.loads(file.read_text()) if file.exists() else None, out, err.splitlines())

    return _offline


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bag") / "run"
    write_run(path, samples())
    return path


def straight(run_: Sequence[Sample], config: Config, seed: int = 1) -> list[Estimate]:
    """Return the estimates of a plain loop over the core."""
    state, estimates = init(config, seed), []
    for _, reading in run_:
        assert reading.position_m is not None
        gauge = max(reading.pressure_pa - 101_325.0, 0.0)
        measurement = Measurement(START_NS + reading.t_ns, reading.position_m, 0.25, gauge)
        state, estimate = step(config, state, measurement)
        estimates += [] if estimate is None else [estimate]
    return [*estimates, *finish(config, state)[1]]


def test_it_reports_what_the_core_finds(bag: Path, offline: Offline) -> None:
    code, result, out, _ = offline(bag)
    expected = straight(samples(), FAST_CONFIG)
    assert code == 0
    assert {key for key in result if not key.startswith("ms_per_window")} == KEYS | {ERROR}
    assert (result["measurements"], result["accepted"], result["dropped"]) == (180, 180, {})
    assert result["windows"] == sum(estimate.window > 0 for estimate in expected) == 13
    assert result["mu_final"] == expected[-1].mu
    assert result["mu_lower_final"] == expected[-1].mu_lower
    assert result["regime_final"] == expected[-1].regime.name
    assert len(result["digest"]) == 64
    assert all(f"{key} " in out and str(result[key]) in out for key in KEYS)


def test_the_error_is_that_of_the_settled_estimates(bag: Path, offline: Offline) -> None:
    truths = {START_NS + truth.t_ns: truth for truth, _ in samples()}
    errors = [
        abs(estimate.mu / truth.mu - 1.0)
        for estimate in straight(samples(), FAST_CONFIG)
        if (truth := truths[estimate.t_ns]).regime == "ADHESION_LIMITED" and truth.speed_mps < 270 / 3.6
    ]
    assert len(errors) >= 2
    assert offline(bag).result[ERROR] == pytest.approx(100 * np.mean(errors))


def test_a_second_run_and_any_rate_give_the_same_bits(bag: Path, offline: Offline) -> None:
    first, *others = (offline(bag, *options).result for options in ([], [], ["--rate", "0"], ["--rate", "50"]))
    for other in others:
        assert {key: other[key] for key in KEYS} == {key: first[key] for key in KEYS}


def test_json_on_standard_output_stands_alone(bag: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert replay.main([str(bag), "--offline", *FAST_SETTINGS, "--json", "-"]) == 0
    assert set(json.loads(capfd.readouterr().out)) >= KEYS


def test_a_single_file_will_do(bag: Path, offline: Offline) -> None:
    assert offline(bag / file_name(0)).result["digest"] == offline(bag).result["digest"]


@pytest.mark.parametrize("spoil", [lambda cdr: cdr[: len(cdr) // 2], lambda _: b"", lambda cdr: b"\xff" * len(cdr)])
def test_a_message_that_does_not_decode_is_counted_and_the_rest_used(
    tmp_path: Path, offline: Offline, spoil: Callable[[bytes], bytes]
) -> None:
    def left_out(topic: Topic, index: int, cdr: bytes) -> bool:
        return index == 60 + list(TRUTH_AND_SENSORS).index(topic)

    write_run(tmp_path / "bad", samples(), edit=lambda *one: spoil(one[2]) if left_out(*one) else one[2])
    with BagReader(tmp_path / "bad") as reader, BagWriter(tmp_path / "good") as writer:
        for record in reader.messages():
            if record.is_whole:
                writer.write(record.topic, record.type, record.cdr, record.log_ns)
    bad, good = offline(tmp_path / "bad"), offline(tmp_path / "good")
    assert (bad.code, bad.result["dropped"], good.result["dropped"]) == (0, {"UNDECODABLE": 4}, {})
    assert (bad.result["measurements"], bad.result["accepted"]) == (180, 179)
    assert good.result["digest"] == bad.result["digest"]
    assert good.result[ERROR] == bad.result[ERROR]


def test_a_truth_that_is_none_is_counted(tmp_path: Path, offline: Offline) -> None:
    def edit(topic: Topic, index: int, cdr: bytes) -> bytes:
        wrong = topic is TRUTH_MU and index == 60
        return serialize(deserialize(cdr, topic.type).__class__(data=math.nan), topic.type) if wrong else cdr

    write_run(tmp_path / "bag", samples(), edit=edit)
    assert offline(tmp_path / "bag").result["dropped"] == {"NOT_FINITE": 1}


def test_the_seed_changes_the_result(bag: Path, offline: Offline) -> None:
    one, two, again = (offline(bag, "--seed", seed).result for seed in ("1", "2", "1"))
    assert one["digest"] == again["digest"] == offline(bag).result["digest"] != two["digest"]
    assert two["mu_final"] == straight(samples(), FAST_CONFIG, 2)[-1].mu


def test_a_setting_is_used(bag: Path, offline: Offline) -> None:
    config = setup_of({**FAST, "window": 40}).config
    shorter = offline(bag, "--set", "window=40").result
    assert shorter["mu_final"] == straight(samples(), config)[-1].mu != straight(samples(), FAST_CONFIG)[-1].mu
    rougher = offline(bag, "--set", "window=40", "--set", "train.resistance_c0=5.79").result
    # 5 N/kN more of the same braking are not the adhesion's; the few iterations leave some of the start in both.
    assert 0.003 < shorter["mu_final"] - rougher["mu_final"] < 0.007


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


def test_remapped_names_change_no_bit(tmp_path: Path, bag: Path, offline: Offline) -> None:
    names = {POSITION: "/odometry/position", BRAKE_PRESSURE: "/brakes/cylinder", **NO_TRUTH}
    write_run(tmp_path / "elsewhere", samples(), names=names)
    remaps = ["--remap", "/odometry/position:=position", "brakes/cylinder:=/brake_pressure"]
    code, result, _, err = offline(tmp_path / "elsewhere", *remaps)
    assert (code, err) == (0, [])
    assert result["digest"] == offline(bag).result["digest"]
    assert offline(tmp_path / "elsewhere", *remaps[:2]).result["digest"] != result["digest"]


def test_without_truth_there_is_no_error(tmp_path: Path, bag: Path, offline: Offline) -> None:
    write_run(tmp_path / "real", samples(), names=NO_TRUTH)
    result = offline(tmp_path / "real").result
    assert {key for key in result if not key.startswith("ms_per_window")} == KEYS
    assert result["digest"] == offline(bag).result["digest"]


def test_the_chosen_topics_alone_are_replayed(bag: Path, offline: Offline) -> None:
    result = offline(bag, "--topics", "position").result
    assert ERROR not in result
    assert result["measurements"] == 180
    assert result["digest"] != offline(bag).result["digest"]  # a full brake is assumed


def test_a_cut_bag_is_replayed_up_to_the_cut(tmp_path: Path, offline: Offline) -> None:
    sizes = write_run(tmp_path / "cut", samples())
    (tmp_path / "cut/metadata.yaml").unlink()
    file = tmp_path / "cut" / file_name(0)
    file.write_bytes(file.read_bytes()[: sizes[120] + 20])
    code, result, _, err = offline(tmp_path / "cut")
    assert code == 0
    assert (result["measurements"], result["accepted"]) == (121, 121)
    assert result["mu_final"] == straight(samples()[:121], FAST_CONFIG)[-1].mu
    (loss,) = err
    assert loss.startswith(f"replay: {file} breaks off at byte ")


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
    assert dropped.startswith("replay: 20 messages were dropped: BAD_VARIANCE: ")
    assert (code, why) == (1, f"replay: nothing is identified: {result['why']}")
    assert result["why"] == "no estimate came of it; see what was dropped, and why"
    assert set(result) == KEYS | {"why"}
    assert (result["measurements"], result["accepted"], result["dropped"]) == (20, 0, {"BAD_VARIANCE": 20})
    assert [result[key] for key in ("mu_final", "mu_lower_final", "regime_final", "windows")] == [None, None, None, 0]


def test_a_bag_without_position_says_what_there_is(tmp_path: Path, offline: Offline) -> None:
    write_run(tmp_path / "other", samples()[:3], names={POSITION: "/gnss/position", **NO_TRUTH})
    code, result, out, (line,) = offline(tmp_path / "other")
    assert (code, result, out) == (2, None, "")
    assert "topic position: not in the recording. It holds: /brake_pressure (" in line
    assert line.endswith("for instance --remap /gnss/position:=position")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--set", "windw=40"], "setting 'windw=40': write NAME=VALUE with one of seed, frame, ambient_pressure_pa"),
        (["--set", "window=forty"], "setting window = 'forty': give a value of type int"),
        (["--set", "window=2"], "window = 2: give a value from 3 to 10000"),
        (["--set", "window=10"], "step = 10: choose less than the window, 10"),
        (["--set", "train.mass_kg=nan"], "train.mass_kg = nan: give a value from 1000 to 1e+08 kg"),
        (["--set", "low_adhesion=ice"], "low_adhesion = 'ice': choose one of "),
        (["--set", "track=tunnel 0"], "track section 'tunnel 0': write 'grade START END RISE'"),
        (["--seed", "-1"], "seed = -1: give "),
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
    ("text", "message"),
    [
        ("", "not a readable ROS parameter file"),
        ("a: [1", "not a readable ROS parameter file"),
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


def test_bad_usage_ends_with_code_2(bag: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for arguments in (["--offline"], [str(bag), "--offline", "--nothing"], [str(bag), "--offline", "--seed", "one"]):
        with pytest.raises(SystemExit) as ended:
            replay.main(arguments)
        assert ended.value.code == 2
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("name", ["tunnel_entry", "tunnel_exit"])
def test_something_is_identified_in_the_reference_recordings(name: str, offline: Offline) -> None:
    code, result, _, err = offline(ROOT / "bags" / name, fast=False)
    assert (code, err) == (0, [])
    assert "why" not in result

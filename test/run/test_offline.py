# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

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
from adhesion_node.bag.write.writer import file_name
from adhesion_node.command import options as cli
from adhesion_node.core import Config, Estimate, Measurement, finish, init, step
from adhesion_node.nodes import replay
from adhesion_node.wire.settings.setup import setup_of
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION, TRUTH_MU, TRUTH_STATE
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


def test_a_second_run_gives_the_same_bits(bag: Path, offline: Offline) -> None:
    first, other = (offline(bag).result for _ in range(2))
    assert {key: other[key] for key in KEYS} == {key: first[key] for key in KEYS}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--rate", "1"], "--rate 1.0: is for a replay to topics: leave it out, or --offline"),
        (["--rate", "0"], "--rate 0.0: is for a replay to topics: leave it out, or --offline"),
        (["--wait-for-subscribers", "0"], "--wait-for-subscribers 0: is for a replay to topics"),
        (["--node", "/train1/estimator"], "--node /train1/estimator: says whose of --params: add that, or leave"),
    ],
)
def test_an_option_without_effect_is_refused(bag: Path, offline: Offline, options: list[str], said: str) -> None:
    code, _, out, (line,) = offline(bag, *options)
    assert (code, out) == (2, "")
    assert line.startswith(f"replay: {said}")


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


@pytest.mark.parametrize("name", ["tunnel_entry", "tunnel_exit"])
def test_something_is_identified_in_the_reference_recordings(name: str, offline: Offline) -> None:
    code, result, _, err = offline(ROOT / "bags" / name, fast=False)
    assert (code, err) == (0, [])
    assert "why" not in result

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is odd in a recording, or on the command line: it is told, and the rest is shown."""

from __future__ import annotations

from pathlib import Path

import pytest
from rclpy.serialization import serialize_message
from reported import lines, make
from slowing import START_NS, S, record, rows, undrawn
from std_msgs.msg import Float64
from test_offline import samples, write_run

from adhesion_node.bag import BagReader, BagWriter, deserialize, serialize
from adhesion_node.bag.types import Definition
from adhesion_node.nodes import replay
from adhesion_node.report.__main__ import main
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_PRESSURE, TRUTH_MU

__all__ = ["undrawn"]

QUICK = ("--set", "estimate_s=1.0")


@pytest.mark.usefixtures("undrawn")
def test_what_a_replay_remarks_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Half of the pressures are in bar, and so refused; the train slows by more than its brake."""

    def in_bar(topic: Topic, index: int, cdr: bytes) -> bytes:
        message = deserialize(cdr, topic.type)
        if topic is BRAKE_PRESSURE and index % 2:
            message.fluid_pressure /= 1e5
        return serialize(message, topic.type)

    write_run(tmp_path / "bag", samples(), edit=in_bar)
    weak = (*QUICK, "--set", "train.mass_kg=1500e3")
    replay.main([str(tmp_path / "bag"), "--offline", *weak])
    replayed = capsys.readouterr().err.splitlines()
    make(tmp_path, str(tmp_path / "bag"), *weak)
    assert capsys.readouterr().err.splitlines() == [line.replace("replay: ", "report: bag: ", 1) for line in replayed]
    refused, brake = replayed
    assert "IMPLAUSIBLE_PRESSURE: brake_pressure: fluid_pressure = " in refused
    assert "check the units of speed and pressure, and the train (--train)" in brake


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("results", [True, False])
def test_messages_that_do_not_decode_are_left_out_and_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], results: bool
) -> None:
    if results:
        record(tmp_path / "whole")
    else:
        write_run(tmp_path / "whole", samples(16.0, 24.0))
    spoilt: set[str] = set()
    with BagReader(tmp_path / "whole") as reader, BagWriter(tmp_path / "bag") as writer:
        for one in reader.messages():
            last = one.topic in spoilt or one.log_ns < START_NS + 5 * S
            writer.write(one.topic, one.type, one.cdr if last else b"\0\1\0\0\xff", one.log_ns)
            spoilt |= set() if last else {one.topic}
        writer.add_topic("/odd", TRUTH_MU.type, known_as=Definition("ros2msg", "int8 data"))
        writer.write("/odd", TRUTH_MU.type, b"\0\1\0\0\7", 0)
    result, _ = make(tmp_path, str(tmp_path / "bag"), *(() if results else QUICK))
    assert result["runs"][0]["source"] == "as recorded" if results else "estimated from the recorded sensors"
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("report: ")]
    assert len(spoilt) > 3
    odd = f"recorded with another definition of {TRUTH_MU.type} (its fields are int8 data, ours float64 data)"
    told.remove(f"report: bag: topic /odd: {odd}: 1 messages are left out")
    assert set(told) <= {f"report: {topic}: 1 messages do not decode and are left out" for topic in spoilt}
    assert len(told) >= 3


def test_a_recorded_number_that_is_none_leaves_a_gap(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for second in range(20):
            for topic, cdr in rows(second):
                broken = topic is TRUTH_MU and second == 7
                cdr_ = serialize_message(Float64(data=float("nan"))) if broken else cdr
                writer.write(f"/{topic.name.lstrip('/')}", topic.type, cdr_, START_NS + second * S)
    _, page = make(tmp_path, str(tmp_path / "bag"))
    values = lines(page.data["runs"][0], "Adhesion")["true"]["y"]
    assert [second for second, value in enumerate(values) if value is None] == [7]


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("text", ["high", "", "inf", "\u00b2", "9" * 5000])
def test_what_should_be_a_number_and_is_none_is_told(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = dict.fromkeys(("confidence", "dropped.LATE", "changes", "stamp_ns"), text) | {"dropped.OLD": "2"}
    with BagWriter(tmp_path / "bag") as writer:
        for second in range(20):
            for topic, cdr in rows(second, **(told if second > 10 else {})):
                writer.write(f"/{topic.name.lstrip('/')}", topic.type, cdr, START_NS + second * S)
    result, _ = make(tmp_path, str(tmp_path / "bag"))
    assert result["runs"][0]["dropped"] == {"OLD": 2}
    (line,) = capsys.readouterr().err.splitlines()
    odd = ", ".join(f"{key} = {text[:20]!r}" for key in ("confidence", "dropped.LATE"))
    assert line == f"report: bag: its diagnostics tell no number: {odd}: left out"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "does not exist"),
        (["mine", "--target", "-1"], "target = -1.0: give"),
        (["mine", "--set", "windov=3"], "windov"),
        (["mine", "--low", "0.05"], "--low 0.05: is for tables of brakings, not for recordings: leave it out"),
        (
            ["mine", "--set", "start_mu=0.1"],
            "--set start_mu=0.1: results are shown as recorded: add --esti",
        ),
        (["mine", "--seed", "1"], "--seed 1: results are shown as recorded: add --estimate, or leave this out"),
        (["mine", "--remap", "/a:=position"], "--remap /a:=position: results are shown as recorded: add --est"),
        (["mine", "--node", "/a"], "--node /a: says whose of --params: add that, or leave this out"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    record(tmp_path / "mine")
    assert main([*arguments, "--output", "report"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("report: ")
    assert said in line
    assert not (tmp_path / "report").exists()

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The report: the page whole and without network, estimated where only sensors are."""

from __future__ import annotations

import json
import os
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from rclpy.serialization import serialize_message
from slowing import START_NS, TRUTH, S, record, rows, undrawn
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


class Parser(HTMLParser):
    """Collects texts, the embedded data, and every attribute that could fetch something."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.fetched: list[str] = []
        self._inside = ""
        self.data: dict[str, Any] = {}
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._inside = tag if tag in ("script", "style") else self._inside
        if tag == "script" and ("id", "data") in attrs:
            self._inside = "data"
        asked = [name for name, value in attrs if not str(value).startswith("data:")]
        self.fetched += [f"{tag} {name}" for name in asked if name in ("src", "href", "srcset", "action")]
        self.fetched += [tag] if tag in ("iframe", "object", "base") else []

    def handle_endtag(self, tag: str) -> None:
        self._inside = "" if tag in ("script", "style") else self._inside

    def handle_data(self, data: str) -> None:
        if self._inside == "data":
            self.data = json.loads(data)
        elif not self._inside and data.strip():
            self.texts.append(data.strip())


def make(tmp_path: Path, *arguments: str) -> tuple[dict[str, Any], Parser]:
    """Run the command; return its JSON and the page."""
    result = tmp_path / "result.json"
    assert main([*arguments, "--output", str(tmp_path / "report"), "--json", str(result)]) == 0
    return json.loads(result.read_text()), Parser((tmp_path / "report" / "report.html").read_text(encoding="utf-8"))


def test_a_name_of_bytes_that_are_no_text_is_escaped(tmp_path: Path) -> None:
    named = tmp_path / os.fsdecode(b"t\xff")
    write_run(named, samples(15.0, 30.0))
    result, page = make(tmp_path, str(named))
    assert result["runs"][0]["name"] == "t\\udcff"
    assert "t\\udcff" in " ".join(page.texts)


def lines(run: dict[str, Any], title: str) -> dict[str, dict[str, Any]]:
    """Return the lines of the chart whose title begins so, by their labels."""
    (chart,) = (chart for chart in run["charts"] if chart["title"].startswith(title))
    return {line["label"]: line for line in chart["lines"]}


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any], Parser]:
    """The report of a recording with results: its folder, the JSON and the page."""
    folder = tmp_path_factory.mktemp("shown")
    return folder / "report", *make(folder, str(record(folder / "mine")))


def test_a_recording_with_results_is_shown_as_recorded(shown: tuple[Path, dict[str, Any], Parser]) -> None:
    folder, result, page = shown
    (run,) = page.data["runs"]
    assert (run["name"], run["source"], result["runs"][0]["source"]) == ("mine", "as recorded", "as recorded")
    adhesion, speed, forces = (lines(run, title) for title in ("Adhesion", "Speed", "Forces"))
    assert adhesion["identified"]["x"] == list(range(20))
    assert adhesion["identified"]["y"] == [None] * 5 + [0.09] * 15
    assert adhesion["known, nothing claimed"]["y"] == [0.09] * 5 + [None] * 15
    assert [set(adhesion[name]["y"]) for name in ("lower bound", "true")] == [{0.08}, {0.1}]
    assert speed["estimated"]["y"] == pytest.approx([3.6 * (80.0 - 2.0 * second) for second in range(20)], abs=0.006)
    assert forces["brake B"]["y"] == pytest.approx([500.2] * 20, abs=0.05)  # 0.9332 m/s^2 x 536 t
    assert forces["adhesion F, identified"]["y"][5:] == pytest.approx([0.09 * 536 * 9.8] * 15, abs=0.05)
    assert len(run["moments"]) == 20
    for name in ("mine.png", "mine.pdf"):
        assert (folder / name).stat().st_size > 10_000
    assert (folder / "mine.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.usefixtures("undrawn")
def test_of_sensors_alone_the_results_are_those_of_an_offline_replay(tmp_path: Path) -> None:
    write_run(tmp_path / "bag", samples())
    _, page = make(tmp_path, str(tmp_path / "bag"), *QUICK)
    assert replay.main([str(tmp_path / "bag"), "--offline", *QUICK, "--json", str(tmp_path / "replay.json")]) == 0
    replayed = json.loads((tmp_path / "replay.json").read_text())
    (run,) = page.data["runs"]
    assert run["source"] == "estimated from the recorded sensors"
    assert replayed["digest"] in page.texts
    adhesion = lines(run, "Adhesion")
    kinds = {"ADHESION_LIMITED": "identified", "BRAKE_LIMITED": "at least, the brake limits"}
    said = adhesion[kinds.get(replayed["regime_final"], "known, nothing claimed")]
    assert said["y"][-1] == pytest.approx(replayed["mu_final"], abs=1e-5)
    (bound,) = (line["y"][-1] for label, line in adhesion.items() if label.startswith("lower bound, "))
    assert bound == pytest.approx(replayed["mu_lower_final"], abs=1e-5)
    assert run["bands"][-1]["kind"] == replayed["regime_final"].lower()
    assert "estimate_s = 1.0" in page.texts
    last = run["moments"][-1]
    assert last["safe"]["x"][0] == last["nominal"]["x"][0] == pytest.approx(last["place"], abs=0.1)
    assert last["safe"]["y"][-1] == 0.0


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


def test_results_are_estimated_anew_on_demand(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = record(tmp_path / "mine")  # without positions: as recorded it can be shown
    report = tmp_path / "new" / "report"
    assert main([str(bag), "--output", str(report), "--estimate", "--out", str(report / "rows.csv")]) == 2
    assert "topic position: not in the recording" in capsys.readouterr().err
    assert not report.parent.exists(), "an empty folder was left"


def test_the_page_fetches_nothing(shown: tuple[Path, dict[str, Any], Parser]) -> None:
    folder, _, page = shown
    assert page.fetched == []
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert set(re.findall(r"https?://[^\s\"']+", html)) == {"http://www.w3.org/2000/svg"}
    assert "default-src 'none'" in html
    assert '<link rel="icon" href="data:,">' in html, "else a browser asks the server for a picture, in vain"
    assert "img-src data:" in html
    assert not re.search(r"@import|url\((?!#)", html)


def test_recordings_stand_side_by_side_under_their_own_names(tmp_path: Path) -> None:
    first, second = record(tmp_path / "one" / "bag"), record(tmp_path / "two" / "bag", *TRUTH)
    result, page = make(tmp_path, str(first), str(second), "--target", "180")
    assert [run["name"] for run in page.data["runs"]] == [run["name"] for run in result["runs"]] == ["bag", "bag (2)"]
    assert ["true" in lines(run, "Adhesion") for run in page.data["runs"]] == [True, False]
    assert page.data["target_kmh"] == 180.0
    assert all(Path(path).is_file() for run in result["runs"] for path in run["pictures"])


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


@pytest.mark.usefixtures("undrawn")
def test_the_only_train_of_a_recording_is_shown_whatever_its_namespace(tmp_path: Path) -> None:
    without, _ = make(tmp_path, str(record(tmp_path / "bag")))
    within, page = make(tmp_path, str(record(tmp_path / "other" / "bag", namespaces=["/line1/train7"])))
    assert within == without
    assert lines(page.data["runs"][0], "Adhesion")["identified"]["y"] == [None] * 5 + [0.09] * 15


@pytest.mark.usefixtures("undrawn")
def test_of_several_trains_one_is_to_be_chosen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    both = str(record(tmp_path / "both", namespaces=["/train2", "/train1"]))
    assert main([both, "--output", str(tmp_path / "report")]) == 2
    assert capsys.readouterr().err == (
        f"report: bag = {both}: holds the trains /train1, /train2: choose one, --namespace /train1\n"
    )
    assert main([both, "--output", str(tmp_path / "report"), "--namespace", "/train3"]) == 2
    remedy = f"namespace = /train3: not in the recording {both}: choose of /train1, /train2"
    assert remedy in capsys.readouterr().err
    result, _ = make(tmp_path, both, "--namespace", "train2")
    assert result["runs"][0]["source"] == "as recorded"


@pytest.mark.usefixtures("undrawn")
def test_a_setting_that_counts_for_a_recording_with_results_is_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result, _ = make(tmp_path, str(record(tmp_path / "bag")), "--set", "train.mass_kg=400000")
    assert "400 t" in result["train"]
    (tmp_path / "my.yaml").write_text("estimator: {ros__parameters: {start_mu: 0.3, train.mass_kg: 4.0e+5}}\n")
    again, _ = make(tmp_path, str(tmp_path / "bag"), "--params", str(tmp_path / "my.yaml"))
    assert again == result
    assert "only the train, direction and ambient_pressure_pa count; --estimate heeds all" in capsys.readouterr().err


def test_a_name_cannot_break_the_page(tmp_path: Path) -> None:
    _, page = make(tmp_path, str(record(tmp_path / "<b>&amp;<script>")))
    assert page.data["runs"][0]["name"] == "<b>&amp;<script>"
    assert "<b>&amp;<script>" in page.texts


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

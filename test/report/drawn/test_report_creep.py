# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The creep estimator's result in the report: its curve and peak as the slider moves, and what is withheld."""

from __future__ import annotations

from pathlib import Path

import messages
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import serialize_message
from slowing import START_NS, S, read, record, rows
from test_offline import samples, write_run

from adhesion_node.bag import BagReader, BagWriter, select_from
from adhesion_node.report.__main__ import main
from adhesion_node.report.drawn.creep import MOST_CURVES, creep_data, creep_in_words
from adhesion_node.report.read.creep import CreepTaken
from adhesion_node.report.read.estimated import estimate_run
from adhesion_node.report.read.messages import Sample
from adhesion_node.wire.messages.results import Status, Statuses
from adhesion_node.wire.settings.setup import setup_of
from adhesion_node.wire.topics import BRAKE_PRESSURE, DIAGNOSTICS, POSITION

KNOWN = {"p1": "80", "p2": "100", "mu_max": "0.2", "lambda_m": "0.1", "mu_max_lower": "0.18", "mu_max_upper": "0.22"}


def told(t_ns: int, message: str, withheld: bool, name: str = "creep_estimator/peak") -> bytes:
    values = [KeyValue(key=key, value=text) for key, text in (KNOWN | {"withheld": str(withheld).lower()}).items()]
    status = [DiagnosticStatus(name=name, message=message, values=values)]
    return bytes(serialize_message(DiagnosticArray(header=messages.header(t_ns), status=status)))


def record_creep(path: Path, until: int = 15) -> Path:
    """Record 20 s, from 5 s on with the creep estimator: withheld to 10 s, then known, from `until` on withheld."""
    with BagWriter(path) as writer:
        for second in range(20):
            t_ns = START_NS + second * S
            for topic, cdr in rows(second):
                writer.write(f"/{topic.name.lstrip('/')}", topic.type, cdr, t_ns)
            if second >= 5:
                why = "withheld: the surface is changing" if second >= until else "withheld: fewer than min_samples"
                known = 10 <= second < until
                cdr = told(t_ns, "the data tell the peak" if known else why, not known)
                writer.write(f"/{DIAGNOSTICS.name.lstrip('/')}", DIAGNOSTICS.type, cdr, t_ns)
    return path


def test_the_curves_are_those_of_the_recording(tmp_path: Path) -> None:
    run = read(record_creep(tmp_path / "bag"))
    data = creep_data(run.creep, run.origin_ns)
    assert [each["t"] for each in data] == [float(second) for second in range(5, 20)]
    assert [each["withheld"] for each in data] == [True] * 5 + [False] * 5 + [True] * 5
    assert (data[5]["peak"], data[5]["lower"], data[5]["upper"]) == ([0.1, 0.2], 0.18, 0.22)
    assert max(data[5]["y"]) == pytest.approx(0.2, abs=0.001)
    assert creep_in_words(run.creep) == (
        "known in 5 of 15 estimates, last 0.200 at a creep of 0.100; at the end withheld: the surface is changing"
    )
    assert run.regime.values.tolist() == ["COASTING"] * 5 + ["ADHESION_LIMITED"] * 15, "the other estimator's as before"
    assert len(creep_data(run.creep * 100, run.origin_ns)) == MOST_CURVES


def test_of_several_trains_the_curves_are_those_of_the_train_shown() -> None:
    """/diagnostics is shared: those of all trains were one train's."""
    taken = CreepTaken()
    for peak, name in (("0.2", "train_a/creep_estimator/peak"), ("0.3", "creep_estimator/peak")):
        taken.take(Sample(S, S, Statuses(S, (Status(name, 0, "", KNOWN | {"mu_max": peak, "withheld": "false"}),))))
    shown = {namespace: [part["peak"][1] for _, part in taken.curves(namespace)] for namespace in ("train_a", "", "b")}
    assert shown == {"train_a": [0.2], "": [0.3], "b": [0.3]}


def test_of_a_train_that_is_remapped_the_curves_are_its_own(tmp_path: Path) -> None:
    write_run(tmp_path / "sensors", samples()[:400])
    with BagReader(tmp_path / "sensors") as reader, BagWriter(tmp_path / "bag") as writer:
        for record in reader.messages():
            writer.write(f"/train_a{record.topic}", *record[1:])
        for name in ("train_b/creep_estimator/peak", "train_a/creep_estimator/peak"):
            writer.write("/diagnostics", DIAGNOSTICS.type, told(START_NS, name[:7], False, name), START_NS)
    with BagReader(tmp_path / "bag") as reader:
        own = [f"/train_a/{topic.name}:={topic.name}" for topic in (POSITION, BRAKE_PRESSURE)]
        run, *_ = estimate_run(reader, select_from(reader, own), setup_of({"seed": 1}), lambda _: None)
    assert [part["why"] for _, part in run.creep] == ["train_a"]


def test_without_a_creep_estimator_nothing_is_told(tmp_path: Path) -> None:
    run = read(record(tmp_path / "bag"))
    assert run.creep == ()
    assert creep_in_words(run.creep) == "not recorded"


def test_the_page_says_the_peak_and_why_it_is_withheld(tmp_path: Path) -> None:
    browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")
    bags = [str(record_creep(tmp_path / "with")), str(record(tmp_path / "without"))]
    assert main([*bags, "--output", str(tmp_path / "report")]) == 0
    with browser.launched(), browser.open_page() as (page, troubles):
        page.goto(f"{(tmp_path / 'report' / 'report.html').as_uri()}#t=12")
        about, slip = page.locator("p.creep"), page.locator("figure.chart", has_text="Adhesion over creep")
        assert about.all_inner_texts() == ["Creep curve at 12.0 s: peak 0.200 at a creep of 0.100, 0.180 to 0.220"]
        assert slip.count() == 1, "of the run that has one"
        assert slip.locator(".u-label").all_inner_texts() == ["creep", "identified"]
        page.locator("#slider").fill("17")
        assert about.inner_text() == "Creep curve at 17.0 s: withheld: the surface is changing"
        assert slip.locator(".u-label").all_inner_texts() == ["creep", "prior, withheld"]
        page.locator("#slider").fill("2")
        assert about.inner_text() == "Creep curve: no estimate yet"
        assert page.evaluate("[...drawn][6].plot.data[1].every((y) => y == null)")
        found = page.locator("table").first.locator("tr", has_text="Peak of the creep curve").locator("td")
        assert found.nth(1).inner_text().startswith("known in 5 of 15 estimates, last 0.200 at a creep of 0.100")
        assert found.nth(2).inner_text() == "not recorded"
        browser.assert_accessible(page)
        assert troubles == []

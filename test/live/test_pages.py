# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The live page in a real browser: every state of it, by what it says."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from test_live_view import STATUS, S, estimate

from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.atp.supervision import read
from adhesion_node.core.physics.braking import curve
from adhesion_node.core.physics.train import CRH3
from adhesion_node.live.view import View
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import ATP_STATUS, BRAKING_CURVE, MU, POSITION, SPEED, STATE

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")
server = pytest.importorskip("adhesion_node.live.server", reason="the extra `live` is not installed")


@pytest.fixture(autouse=True, scope="module")
def chromium() -> Iterator[None]:
    with browser.launched():
        yield


SHOWN = (STATE, MU, BRAKING_CURVE, ATP_STATUS, POSITION)


class Line:
    """A view whose clock the test sets, and its page."""

    def __init__(self, page: Any, served: Any, view: View) -> None:
        self.page, self.view, self.served = page, view, served
        self.now_s = 0.0

    def hear(self, *topics: Topic) -> None:
        for topic in topics or SHOWN:
            self.view.heard(topic, self.now_s)

    def says(self, where: str) -> str:
        return str(self.page.locator(where).text_content())

    def wait(self, text: str, **options: Any) -> None:
        self.page.get_by_text(text, **options).first.wait_for()

    def level(self, level: str, **values: float) -> None:
        said = STATUS | {"level": level} | {name: str(value) for name, value in values.items()}
        self.view.supervised(said, level.lower())
        self.hear()


@contextmanager
def line(**context: Any) -> Iterator[Line]:
    """Serve a view and open it; nothing may go wrong in the page but that the server has gone."""
    view = View()
    made: list[Line] = []
    served = server.Server("127.0.0.1", 0, lambda: view.parts(made[0].now_s if made else 0.0), 0.05)
    try:
        with browser.open_page(**context) as (page, troubles):
            made.append(Line(page, served, view))
            page.goto(served.url)
            page.get_by_text("waiting for the estimator").wait_for()
            yield made[0]
            assert [trouble for trouble in troubles if "ERR_CONNECTION_REFUSED" not in trouble] == []
    finally:
        served.close()


def test_the_page_follows_the_line() -> None:
    with line() as shown:
        estimate(shown.view, 0)
        estimate(shown.view, 7, mu=0.09)
        shown.view.place(2500.0)
        shown.level("OVERSPEED")
        shown.wait("OVERSPEED: overspeed")
        assert shown.says("#state") == "7 s"
        assert shown.page.locator("#dial svg").get_attribute("aria-label") == "speed 288 km/h"
        limits = shown.page.locator("#limits td:last-child").all_inner_texts()
        assert limits == ["100 km/h in 3500 m", "–", "180 km/h", "184 km/h", "187 km/h", "194 km/h", "369 m"]
        assert shown.says("#mu") == "identified μ̂ 0.0900, at least 0.0850 (95 %)"
        assert shown.page.locator("#inputs td.good").count() == 5
        assert shown.page.locator("#inputs td.never").count() == 2
        shown.view.train(TrainState(1009 * S, 900.0, 50.0))
        shown.wait("9 s", exact=True)
        assert shown.page.locator("#dial svg").get_attribute("aria-label") == "speed 180 km/h"
        shown.view.end(1.0)
        shown.wait("9 s, the run has ended")


def test_a_value_that_is_old_is_blank_and_the_others_stay() -> None:
    """The estimator has ended: before, dial and regime went on with the old speed at the new place."""
    with line() as shown:
        estimate(shown.view, 0)
        shown.level("WARNING")
        shown.wait("WARNING: warning")
        shown.now_s = 3.0
        shown.view.place(2600.0)
        shown.hear(POSITION, ATP_STATUS)
        shown.wait("estimator silent for 3 s")
        assert shown.page.locator("#dial svg").get_attribute("aria-label") == "speed unknown"
        assert shown.says("#dial .digits") == "–"
        assert shown.says("#regime") == "Adhesion: not known"
        assert shown.says("#mu") == "nothing is known of μ: the last value is 3 s old"
        assert shown.page.locator("#gauge .identified").count() == 0
        assert shown.says("#level") == "WARNING: warning"
        states = shown.page.locator("#inputs tr").all_inner_texts()
        assert "late" in states[3]
        assert "good" in states[0]
        shown.now_s = 6.0
        shown.hear(STATE)
        shown.wait("NO SUPERVISION for 3 s")
        assert shown.page.locator("#limits td:last-child").all_inner_texts() == ["–"] * 7


def test_what_a_run_that_has_ended_has_left_grows_old_once_the_program_has_gone() -> None:
    with line() as shown:
        estimate(shown.view, 0)
        shown.hear()
        shown.view.end(1.0)
        shown.wait("the run has ended")
        shown.served.close()
        shown.wait("NO DATA since")
        shown.wait("the last value is 3 s old")


def test_a_program_that_says_nothing_for_a_second_is_no_data_and_one_that_comes_back_begins_anew() -> None:
    with line() as shown:
        estimate(shown.view, 0)
        shown.level("NORMAL")
        shown.wait("NORMAL: below all limits")
        shown.page.evaluate("window.silentAt = performance.now()")
        port = int(shown.served.url.rsplit(":", 1)[1].strip("/"))
        shown.served.close()
        shown.wait("NO DATA since")
        assert shown.page.evaluate("performance.now() - window.silentAt") < 2500.0
        assert "is the program running?" in shown.says("#nodata")
        size = shown.page.locator("#nodata").evaluate("(banner) => parseFloat(getComputedStyle(banner).fontSize)")
        assert size > 30.0
        assert shown.page.evaluate("getComputedStyle(document.querySelector('main')).filter") == "grayscale(1)"
        assert (shown.says("#level"), shown.says("#dial .digits")) == ("NO DATA", "–")
        assert set(shown.page.locator("#limits td:last-child").all_inner_texts()[1:]) == {"–"}
        assert shown.says("#regime") == "Adhesion: not known"
        assert shown.says("#announce") == "No data"
        again = server.Server("127.0.0.1", port, lambda: View().parts(0.0), 0.05)
        try:
            shown.wait("waiting for the estimator")
            assert not shown.page.locator("#nodata").is_visible()
            assert shown.page.evaluate("course.plot.data[0].length") == 2, "the charts of the run before"
            assert shown.page.locator("#events li").count() == 0
        finally:
            again.close()


def test_a_new_run_clears_the_charts() -> None:
    with line() as shown:
        for second in range(20):
            estimate(shown.view, second)
        shown.hear()
        shown.wait("19 s", exact=True)
        assert shown.page.evaluate("course.plot.data[0].length") > 20
        estimate(shown.view, 0)
        shown.wait("0 s", exact=True)
        assert shown.page.evaluate("course.plot.data[0].length") < 5


@pytest.mark.parametrize(
    ("regime", "kind", "said"),
    [
        ("ADHESION_LIMITED", "identified", "identified μ̂ 0.0945, at least 0.0895 (95 %)"),
        ("BRAKE_LIMITED", "atleast", "μ ≥ 0.0945, which the brake uses; at least 0.0895 (95 %)"),
        ("COASTING", "prior", "not identified; prior 0.0945, not claimed; at least 0.0895 (95 %)"),
    ],
)
def test_only_what_is_identified_is_called_so(regime: str, kind: str, said: str) -> None:
    """A brake-limited adhesion of 0.0945 was labelled identified while the true one was 0.239, off the scale."""
    with line() as shown:
        shown.view.adhesion("true_mu", 0.239)
        for second in (0, 1, 2):
            estimate(shown.view, second, mu=0.0945, regime=regime)
        shown.hear()
        shown.wait(said)
        drawn = {
            name: shown.page.evaluate(
                "(label) => course.plot.data[course.plot.series.findIndex((s) => s.label.startsWith(label))]"
                ".filter((y) => y != null)",
                label,
            )
            for name, label in (("identified", "identified"), ("atleast", "≥"), ("prior", "prior"))
        }
        assert drawn == {name: [0.0945] * 3 if name == kind else [] for name in drawn}
        assert shown.page.evaluate("course.plot.scales.y.max") >= 0.239
        assert shown.page.locator("#gauge .at.truth").evaluate("(at) => parseFloat(at.style.left)") < 99.0
        right = shown.page.evaluate(  # in one call, as the page draws the gauge anew meanwhile
            "(kind) => { const span = document.querySelector(`#gauge .span.${kind}`);"
            " return span.getBoundingClientRect().right - span.parentElement.getBoundingClientRect().right }",
            kind,
        )
        assert (abs(right) < 2.0) is (kind == "atleast"), "open above only where the brake limits"


@pytest.mark.parametrize(
    ("level", "pointer", "digits", "text"),
    [
        ("NORMAL", "rgb(195, 195, 195)", "rgb(0, 0, 0)", "NORMAL: below all limits"),
        ("INDICATION", "rgb(223, 223, 0)", "rgb(0, 0, 0)", "INDICATION: indication"),
        ("OVERSPEED", "rgb(234, 145, 0)", "rgb(0, 0, 0)", "OVERSPEED: overspeed"),
        ("WARNING", "rgb(234, 145, 0)", "rgb(0, 0, 0)", "WARNING: warning"),
        ("SERVICE_BRAKE", "rgb(191, 0, 2)", "rgb(255, 255, 255)", "SERVICE BRAKE: service_brake"),
        ("EMERGENCY_BRAKE", "rgb(191, 0, 2)", "rgb(255, 255, 255)", "EMERGENCY BRAKE: emergency_brake"),
    ],
)
def test_every_level_has_its_colour(level: str, pointer: str, digits: str, text: str) -> None:
    with line() as shown:
        estimate(shown.view, 0)
        shown.view.place(2500.0)
        shown.level(level)
        shown.wait(text)
        fills = [
            shown.page.locator(where).evaluate("(part) => getComputedStyle(part).fill")
            for where in ("#dial circle", "#dial .digits")
        ]
        assert fills == [pointer, digits]
        looks = shown.page.locator("#level").evaluate("(box) => getComputedStyle(box).backgroundColor + box.className")
        others = shown.page.evaluate(
            "(own) => ['normal', 'indication', 'overspeed', 'warning', 'service_brake'].filter((name) => name !== own)"
            ".map((name) => { const box = document.getElementById('level'), was = box.className;"
            " box.className = `level ${name}`; const look = getComputedStyle(box).backgroundColor;"
            " box.className = was; return look + was; })",
            level.lower(),
        )
        assert level.endswith("_BRAKE") or looks not in others, "a level looks like another one"
        assert (shown.page.locator("#dial .bar").count() == 1) is (level != "NORMAL"), "the target bar"


def test_limits_ahead_and_the_time_to_the_indication() -> None:
    with line() as shown:
        config, braking = SupervisionConfig(), curve(CRH3, 80.0, 0.09)
        state = TrainState(1000 * S, 1500.0, 80.0, 0.5, 0.1)
        reading = read(config, braking, state, 1000 * S)
        estimate(shown.view, 0)
        shown.view.place(1500.0)
        shown.view.curve("safe", StampedCurve(0, 1500.0, braking))
        numbers = {"target_position_m": 6000.0, "target_speed_mps": config.target_speed_mps, **reading._asdict()}
        shown.level("NORMAL", **numbers)
        shown.wait("100 km/h in 4500 m")
        ends = shown.page.evaluate(
            "way.plot.series.slice(1, 5).map((series, i) =>"
            " [series.label, way.plot.data[i + 1].findLast((y) => y != null)])"
        )
        assert [label for label, _ in ends] == ["permitted", "warning", "service brake", "emergency brake"]
        assert dict(ends)["permitted"] == pytest.approx(100.0, abs=0.1)
        assert dict(ends)["emergency brake"] == pytest.approx(107.5, abs=0.1)
        soon = shown.page.locator("#limits tr", has_text="indication in").locator("td").nth(1).inner_text()
        indicated_s = shown.view.parts(0.0)["supervision"]["to_indication_s"]
        assert indicated_s > 1.0
        assert soon == f"{indicated_s:.0f} s"


def test_a_target_that_is_passed_is_said_so() -> None:
    with line() as shown:
        estimate(shown.view, 0)
        shown.view.place(9322.0)
        shown.level("NORMAL", distance_to_target_m=-3322.0)
        shown.wait("100 km/h, passed")
        assert "-3322" not in shown.says("body")


def test_events_are_listed_and_marked() -> None:
    with line() as shown:
        estimate(shown.view, 0, regime="COASTING")
        estimate(shown.view, 4)
        shown.view.heard(SPEED, 0.0, "speed = nan")
        shown.level("EMERGENCY_BRAKE")
        shown.wait("4 s: EMERGENCY BRAKE")
        assert shown.page.locator("#events li").all_inner_texts() == [
            "4 s: EMERGENCY BRAKE",
            "4 s: speed refused: speed = nan",
            "4 s: the adhesion limits",
            "0 s: nothing is claimed",
        ]


def test_the_creep_curve_its_peak_and_what_is_withheld() -> None:
    known = {
        "p1": "80",
        "p2": "100",
        "mu_max": "0.2",
        "lambda_m": "0.1",
        "mu_max_lower": "0.18",
        "mu_max_upper": "0.22",
    }
    with line() as shown:
        assert not shown.page.locator("#creep").is_visible()
        shown.view.creep(known | {"withheld": "true"}, "withheld: the data do not reach the peak", 0.0)
        shown.wait("withheld: the data do not reach the peak")
        assert shown.page.evaluate("slip.plot.series[1].label") == "prior, withheld"
        shown.view.creep(known | {"withheld": "false"}, "known", 0.0)
        shown.wait("peak 0.200 at a creep of 0.100, 0.180 to 0.220")
        assert shown.page.evaluate("slip.plot.series[1].label") == "identified"
        shown.now_s = 4.0
        shown.hear(POSITION)
        shown.wait("nothing from the creep estimator for 4 s")
        assert shown.page.evaluate("slip.plot.data[1].every((y) => y == null)")


def test_ten_tabs_see_the_line() -> None:
    """A browser opens six streams of events to one host: the seventh tab stayed empty."""
    with line() as shown:
        tabs = [shown.page.context.new_page() for _ in range(9)]
        for tab in tabs:
            tab.goto(shown.served.url)
        estimate(shown.view, 3)
        shown.hear()
        for tab in tabs:
            tab.get_by_text("identified μ̂ 0.0800").wait_for()


def test_a_reader_hears_what_changes_and_not_every_second() -> None:
    with line() as shown:
        shown.page.evaluate(
            "window.heard = []; new MutationObserver(() => window.heard.push(byId('announce').textContent))"
            ".observe(byId('announce'), { childList: true, characterData: true, subtree: true })"
        )
        for second in range(30):
            estimate(shown.view, second)
            shown.level("NORMAL", distance_to_target_m=3500.0 - 80.0 * second)
            shown.wait(f"{second} s", exact=True)
        shown.level("WARNING")
        shown.wait("WARNING: warning")
        assert shown.page.locator("[role=status], [role=alert], [aria-live]").count() == 1
        assert shown.page.evaluate("window.heard.length") <= 4
        assert shown.page.evaluate("window.heard.at(-1)") == "WARNING: warning. Adhesion: the adhesion limits"


@pytest.mark.parametrize("look", [*browser.LOOKS, "no data"])
def test_the_page_can_be_used_by_everybody(look: str) -> None:
    with line(**browser.LOOKS.get(look, {})) as shown:
        for second, regime in enumerate(("COASTING", "BRAKE_LIMITED", "ADHESION_LIMITED")):
            estimate(shown.view, second, regime=regime)
        shown.level("WARNING")
        shown.wait("WARNING: warning")
        if look == "no data":
            shown.served.close()
            shown.wait("NO DATA since")
        browser.turn(shown.page, look)
        browser.assert_accessible(shown.page)
        assert shown.page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "columns are cut off"


def test_forced_colours_leave_nothing_invisible() -> None:
    with line(forced_colors="active") as shown:
        estimate(shown.view, 0)
        shown.level("EMERGENCY_BRAKE")
        shown.wait("EMERGENCY BRAKE")
        digits, hub, line_, paper = shown.page.evaluate(
            "[getComputedStyle(document.querySelector('#dial .digits')).fill, getComputedStyle(document.querySelector("
            "'#dial circle')).fill, ink('identified'), getComputedStyle(document.body).backgroundColor]"
        )
        assert digits != hub
        assert line_ != paper


def test_a_laptop_shows_it_all_without_scrolling() -> None:
    with line(viewport={"width": 1366, "height": 768}) as shown:
        for second in range(30):
            estimate(shown.view, second, regime=("COASTING", "BRAKE_LIMITED", "ADHESION_LIMITED")[second % 3])
        shown.level("WARNING")
        shown.wait("WARNING: warning")
        assert shown.page.evaluate("document.documentElement.scrollHeight <= innerHeight")
        for part in ("#inputs", "#adhesion .u-legend", "#limits"):
            box = shown.page.locator(part).bounding_box()
            assert box["y"] + box["height"] <= 768.0, part

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The live page in a real browser: it follows the line, and says what is old, ended, silent or new."""

from __future__ import annotations

import pytest
from pages import line, server
from told_view import S, estimate

from adhesion_node.core.atp.received import TrainState
from adhesion_node.live.view import View
from adhesion_node.wire.topics import ATP_STATUS, POSITION, STATE

pytestmark = pytest.mark.usefixtures("chromium")


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
        shown.pass_until("NO DATA since")
        shown.pass_until("the last value is 3 s old")


def test_a_program_that_says_nothing_for_a_second_is_no_data_and_one_that_comes_back_begins_anew() -> None:
    with line() as shown:
        estimate(shown.view, 0)
        shown.level("NORMAL")
        shown.wait("NORMAL: below all limits")
        said = "() => [900, 200].map((ms) => { passed_ms += ms; draw(); return byId('nodata').hidden })"
        assert shown.page.evaluate(said) == [True, False], "after 0.9 s, after 1.1 s"
        port = int(shown.served.url.rsplit(":", 1)[1].strip("/"))
        shown.served.close()
        shown.pass_until("NO DATA since")
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


def test_ten_tabs_see_the_line() -> None:
    """A browser opens six streams of events to one host: the seventh tab stayed empty."""
    with line() as shown:
        tabs = [shown.page.context.new_page() for _ in range(9)]
        for tab in tabs:
            tab.goto(shown.served.url)
        estimate(shown.view, 3)
        shown.hear()
        shown.tell()
        for tab in tabs:
            tab.get_by_text("identified μ̂ 0.0800").wait_for()

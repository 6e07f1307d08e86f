# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The report in a real browser: what it says, and how it is used."""

from __future__ import annotations

from itertools import pairwise

import pytest
import seen
from reports import an_hour, shown_range, two_runs

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")


pytestmark = pytest.mark.usefixtures("chromium")


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> str:
    return two_runs(tmp_path_factory.mktemp("report"))


def test_the_report_draws_every_chart_of_every_run(report: str) -> None:
    with browser.open_page() as (page, troubles):
        page.goto(report)
        assert page.locator("figure.chart canvas").count() == 12
        assert page.locator("section.run h2").all_inner_texts() == ["with", "without"]
        assert page.locator("section.run").nth(0).locator(".u-legend", has_text="what the train did").count() == 1
        assert troubles == []


def test_the_slider_moves_the_present_of_all_runs(report: str) -> None:
    with browser.open_page() as (page, troubles):
        page.goto(f"{report}#t=12")
        for readout in page.locator(".readout").all():
            assert (
                ": 201.6 km/h, identified μ̂ 0.0900, at least 0.0800, the adhesion limits;" in readout.inner_text()
            )  # 80 - 2 * 12 m/s
        present = page.locator(".present").nth(1)
        before = present.get_attribute("style")
        page.locator("#slider").fill("5")
        assert page.locator("#time").inner_text().startswith("5")
        for readout in page.locator(".readout").all():
            assert ": 252.0 km/h, " in readout.inner_text()
        assert present.get_attribute("style") != before
        assert troubles == []


def test_the_report_needs_nothing_but_itself(report: str) -> None:
    asked: list[str] = []
    with browser.open_page() as (page, troubles):
        page.on("request", lambda request: asked.append(request.url))
        page.goto(report)
        page.locator("summary").first.click()
        assert page.locator("details table tr").count() > 30
        assert troubles == []
    assert asked == [report]


@pytest.fixture(scope="module")
def hour(tmp_path_factory: pytest.TempPathFactory) -> str:
    return an_hour(tmp_path_factory.mktemp("hour"))


def test_the_headline_is_of_all_brakings_and_each_has_a_row(hour: str) -> None:
    """Before: one moment, "saved at least 39 m (95 %)", while the bound was above the truth and the brake came."""
    with browser.open_page() as (page, troubles):
        page.goto(hour)
        findings, brakings = page.locator("table").nth(0), page.locator("table").nth(1)
        told = dict(row.split("\t") for row in findings.locator("tr").all_inner_texts()[1:])
        assert told["Brakings"] == "7"
        assert told["Recorded"] == "2023-11-14 22:13:20 UTC"
        assert told["Lower bound of μ kept"].startswith("99.5 % of 210 estimates under the brake")
        assert told["Changes of the rail found"] == "1: at 620.0 s"
        assert told["Interventions of the ATP monitor"] == "1: emergency brake at 620.0 s"
        assert not any("saved" in name.lower() for name in told)
        assert brakings.locator("tbody tr").count() == 7
        second = brakings.locator("tbody tr").nth(1).locator("td").all_inner_texts()
        assert second[1:3] == ["288\u00a0→\u00a079", "adhesion 80%, the brake 7%"]
        assert second[7] == "1: at 620.0 s"
        assert page.get_by_role("cell", name="620.0\u00a0s", exact=True).count() >= 1, "a time is not broken"
        saved = [int(row.split()[0]) for row in brakings.locator("td:last-child").all_inner_texts()[:2]]
        assert saved[1] < saved[0] - 100, "a promise that the change of the rail has taken back"
        assert troubles == []


def test_a_row_shows_its_braking_in_all_charts(hour: str) -> None:
    with browser.open_page() as (page, troubles):
        page.goto(hour)
        assert shown_range(page, 1) == pytest.approx([0.0, 3629.0], abs=5.0)
        page.get_by_role("button", name="1200.0 s").click()
        assert shown_range(page, 1) == shown_range(page, 2) == pytest.approx([1195.0, 1234.0], abs=0.1)
        page.wait_for_function("() => location.hash === '#t=1200'")
        assert "288.0 km/h, μ̂ 0.0900, at least 0.0800, nothing is claimed" in page.locator(".readout").inner_text()
        low, high = shown_range(page, 0)
        assert high - low < 10_000.0, "a curve of some km on the axis of the whole way"
        assert page.locator("#slider").get_attribute("min") == "1195"
        page.locator(".u-over").nth(1).dblclick()
        assert shown_range(page, 1) == pytest.approx([0.0, 3629.0], abs=5.0)
        assert troubles == []


def test_values_under_the_pointer_zoom_and_keyboard(hour: str) -> None:
    with browser.open_page() as (page, troubles):
        page.goto(f"{hour}#t=610")
        page.get_by_role("button", name="600.0 s", exact=True).click()
        over = page.locator(".u-over").nth(1)
        over.scroll_into_view_if_needed()
        box = over.bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20)
        rows = page.locator("figure.chart").nth(1).locator(".u-series").all_inner_texts()
        assert [text for text in rows if text.startswith("identified")] == ["identified0.09"]
        assert any(
            text.startswith("estimated") and "–" not in text for text in page.locator(".u-series").all_inner_texts()
        )
        low, high = shown_range(page, 1)
        page.mouse.wheel(0, -300)
        page.wait_for_function(
            "(was) => { const s = [...drawn][1].plot.scales.x; return s.max - s.min < was }", arg=high - low
        )
        page.locator(".u-wrap").nth(1).focus()
        before = shown_range(page, 1)
        page.keyboard.press("ArrowRight")
        page.wait_for_function("(was) => [...drawn][1].plot.scales.x.min > was", arg=before[0])
        before = shown_range(page, 1)
        page.mouse.wheel(100, 0)
        page.wait_for_function("(was) => [...drawn][1].plot.scales.x.min > was", arg=before[0])
        low, high = shown_range(page, 1)
        assert high - low == pytest.approx(before[1] - before[0]), "to the side it does not zoom"
        page.keyboard.press("0")
        page.wait_for_function("[...drawn][1].plot.scales.x.min === 0")
        page.mouse.move(box["x"] + 100, box["y"] + 50)
        page.mouse.down()
        page.mouse.move(box["x"] + 300, box["y"] + 50)
        page.mouse.up()
        page.wait_for_function("(was) => [...drawn][1].plot.scales.x.min > was", arg=100.0)
        assert troubles == []


def test_the_slider_stays_in_sight_and_the_address_is_the_moment(hour: str) -> None:
    with browser.open_page() as (page, _):
        page.goto(hour)
        page.locator("figure.chart").nth(5).scroll_into_view_if_needed()
        assert page.locator("#slider").bounding_box()["y"] < 100.0
        page.locator("#slider").fill("605.5")
        page.wait_for_function("() => location.hash === '#t=605.5'")
        page.evaluate("location.hash = '#t=1210'")
        page.wait_for_function("document.getElementById('time').textContent === '1210.0 s'")


def test_a_slider_that_moves_long_leaves_the_address_time(hour: str) -> None:
    """Before: Safari, which takes 100 changes of the address in ten seconds, refused and showed an old moment."""
    with browser.open_page() as (page, troubles):
        page.goto(hour)
        page.evaluate(
            "window.replaced = []; const replace = history.replaceState.bind(history);"
            " history.replaceState = (...given) => { replaced.push(performance.now()); replace(...given); };"
            " for (let t = 0; t <= 1000; t++) show(t)"
        )
        page.wait_for_function("() => location.hash === '#t=1000'")
        at_ms = page.evaluate("replaced")
        assert all(later - earlier > 190.0 for earlier, later in pairwise(at_ms)), "five times a second at most"
        assert troubles == []


def test_a_phone_scrolls_to_columns_as_wide_as_their_heads(hour: str) -> None:
    """Before: one of ten columns on a phone had its head in seven lines."""
    with browser.open_page(**browser.LOOKS["phone"]) as (page, _):
        page.goto(hour)
        assert page.locator("table").nth(1).locator("thead").bounding_box()["height"] <= 100.0


@pytest.mark.parametrize("look", browser.LOOKS)
def test_the_report_can_be_used_by_everybody(hour: str, look: str) -> None:
    with browser.open_page(**browser.LOOKS[look], device_scale_factor=2) as (page, troubles):
        page.goto(hour)
        browser.turn(page, look)
        browser.assert_accessible(page)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "columns are cut off"
        seen.assert_readable(seen.look(page))
        assert troubles == []

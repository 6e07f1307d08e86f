# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The report in a real browser: by what it says and what its charts hold."""

from __future__ import annotations

from typing import Any

import pytest
import seen
from slowing import TRUTH, record
from test_report_brakings import journey

from adhesion_node.report.__main__ import main

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")


pytestmark = pytest.mark.usefixtures("chromium")

CUT_OFF = (
    "[...document.querySelectorAll('.scroll')].filter((each) => each.scrollWidth > 680).map((each) => each.innerText)"
)
"""The tables that are wider than the paper."""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the address of a report of two runs, the second without truth: 80 m/s, 2 m/s^2 slower each second."""
    tmp_path = tmp_path_factory.mktemp("report")
    bags = [str(record(tmp_path / "with")), str(record(tmp_path / "without", *TRUTH))]
    assert main([*bags, "--output", str(tmp_path / "report"), "--target", "180"]) == 0
    return (tmp_path / "report" / "report.html").as_uri()


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
    """Return the address of a report of seven brakings in an hour; in the second one the rail gets worse."""
    tmp_path = tmp_path_factory.mktemp("hour")
    bag = str(journey(tmp_path / "hour", 7))
    assert main([bag, "--output", str(tmp_path / "report"), "--target", "60"]) == 0
    return (tmp_path / "report" / "report.html").as_uri()


def shown_range(page: Any, chart: int) -> list[float]:
    found: list[float] = page.evaluate(
        "(i) => { const s = [...drawn][i].plot.scales.x; return [s.min, s.max]; }", chart
    )
    return found


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
        assert "288.0 km/h, not identified; prior 0.0900" in page.locator(".readout").inner_text()
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
            "window.replaced = 0; const replace = history.replaceState.bind(history);"
            " history.replaceState = (...given) => { window.replaced++; replace(...given); };"
            " for (let t = 0; t <= 1000; t++) show(t)"
        )
        page.wait_for_function("() => location.hash === '#t=1000'")
        assert page.evaluate("replaced") <= 2
        assert troubles == []


def test_a_band_has_its_own_name(hour: str) -> None:
    """Before: the name stood left of its band, or half of it was cut off, as the axes aligned their numbers."""
    with browser.open_page() as (page, _):
        page.goto(hour)
        page.get_by_role("button", name="600.0 s", exact=True).click()
        page.wait_for_function("() => [...drawn][2].plot.scales.x.min === 595")
        bands, written = page.evaluate(
            """() => {
              const { plot } = [...drawn][2], { ctx } = plot, { fillText } = ctx, written = [];
              ctx.fillText = (text, x, y) => {
                const { actualBoundingBoxLeft: left, actualBoundingBoxRight: right } = ctx.measureText(text);
                written.push([text, x - left, x + right]);
                fillText.call(ctx, text, x, y);
              };
              plot.batch(() => plot.redraw());
              const at = (x) => plot.valToPos(x, "x", true);
              return [runs[0].bands.map(({ from, to, label }) => [label, at(from), at(to)]), written];
            }"""
        )
        names = {label for label, *_ in bands}
        drawn = [each for each in written if each[0] in names]
        assert drawn
        for name, left, right in drawn:
            assert any(name == label and from_ <= left and right <= to for label, from_, to in bands), name


def test_the_marks_of_a_legend_follow_the_scheme(hour: str) -> None:
    """Before: in the colours that the page was opened in, pale on paper."""
    with browser.open_page() as (page, _):
        page.goto(hour)
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            page.wait_for_function(
                """() => inks.clear() || [...drawn].every(({ plot: { root, series } }) => {
                  const marks = [...root.closest(".chart").querySelectorAll(".u-marker")].slice(1);
                  return marks.every((mark, i) => getComputedStyle(mark).borderTopColor === series[i + 1].stroke());
                })"""
            )


def test_a_legend_has_values_under_the_pointer_alone(hour: str) -> None:
    """Before: "permitted: –" beside a permitted speed, as the pointer was elsewhere."""
    with browser.open_page() as (page, _):
        page.goto(f"{hour}#t=610")
        legend = page.locator("figure.chart").nth(1).locator(".u-legend")
        resting = legend.inner_text()
        assert "identified" in resting
        assert "–" not in resting
        assert "time" not in resting
        page.locator(".u-over").nth(1).hover()
        page.wait_for_function("(was) => document.querySelectorAll('.u-legend')[1].innerText !== was", arg=resting)
        assert "time, s" in legend.inner_text()


def test_the_numbers_of_an_axis_are_whole(hour: str) -> None:
    """Before: of 10,000 m the first figure was cut off."""
    with browser.open_page() as (page, _):
        page.goto(hour)
        for size, longest in page.evaluate(
            "[...drawn].filter((made) => made.plot).map(({ plot }) => [plot.axes[1]._size,"
            " Math.max(...plot.axes[1]._values.map((text) => {"
            " plot.ctx.font = plot.axes[1].font[0]; return plot.ctx.measureText(text).width / uPlot.pxRatio; }))])"
        ):
            assert size >= longest + 15.0, "ticks and their gap take 15 pixels"


def test_a_phone_scrolls_to_columns_as_wide_as_their_heads(hour: str) -> None:
    """Before: one of ten columns on a phone had its head in seven lines."""
    with browser.open_page(**browser.LOOKS["phone"]) as (page, _):
        page.goto(hour)
        assert page.locator("table").nth(1).locator("thead").bounding_box()["height"] <= 100.0


def test_no_line_bridges_where_it_does_not_hold(hour: str) -> None:
    """Before: a prior went on, dotted, through what was identified, as other lines have values within its gap."""
    with browser.open_page() as (page, _):
        page.goto(hour)
        page.evaluate(
            """() => {
              const made = [...drawn][1], dense = Array.from({ length: 201 }, (_, i) => i / 10);
              made.draw({ title: "gap", x: { label: "time, s", range: [0, 20] }, y: { range: [0, 2] }, lines: [
                { label: "dense", kind: "truth", x: dense, y: dense.map(() => 0.2) },
                { label: "with a gap", kind: "sbi", x: [0, 4, 8, 12, 16, 20], y: [1, 1, null, null, 1, 1] }] });
            }"""
        )
        page.wait_for_function("[...drawn][1].plot.scales.x.max === 20")
        ends = page.evaluate("[0, 4, 15].map((x) => [...drawn][1].plot.valToPos(x, 'x'))")
        over = page.locator(".u-over").nth(1).bounding_box()
        picture, yellow = seen.look(page), (138, 109, 0)
        inside, outside = (
            picture.part((over["x"] + from_, over["y"], over["x"] + to, over["y"] + over["height"]))
            for from_, to in ((ends[1] + 5.0, ends[2]), (ends[0], ends[1]))
        )
        assert (outside == yellow).all(axis=-1).sum() > 20
        assert not (inside == yellow).all(axis=-1).any()


def test_the_curves_are_shown_to_where_the_braking_ended(report: str) -> None:
    """Before: on a rail worse than the worst case the chart ended before the train did."""
    with browser.open_page() as (page, _):
        page.goto(f"{report}#t=12")
        assert shown_range(page, 0)[1] >= page.evaluate("runs[0].moments.at(-1).place")


def test_gaps_are_gaps(hour: str) -> None:
    with browser.open_page() as (page, _):
        page.goto(hour)
        between = page.evaluate(
            "(() => { const u = [...drawn][2].plot, k = u.series.findIndex((s) => s.label === 'estimated');"
            " return u.data[0].map((x, i) => [x, u.data[k][i]]).filter(([x, y]) => y === null).length; })()"
        )
        assert between == 6


@pytest.mark.parametrize("look", browser.LOOKS)
def test_the_report_can_be_used_by_everybody(hour: str, look: str) -> None:
    with browser.open_page(**browser.LOOKS[look], device_scale_factor=2) as (page, troubles):
        page.goto(hour)
        browser.turn(page, look)
        browser.assert_accessible(page)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "columns are cut off"
        seen.assert_readable(seen.look(page))
        assert troubles == []


def test_paper_has_both_runs_one_below_the_other_in_readable_letters(report: str) -> None:
    """Before: the second run was cut off, and the letters of the axes were 3 to 5 points high."""
    with browser.open_page() as (page, troubles):
        page.goto(f"{report}#t=12")
        browser.turn(page, "print")
        boxes = [run.bounding_box() for run in page.locator("section.run").all()]
        assert boxes[1]["y"] >= boxes[0]["y"] + boxes[0]["height"]
        for canvas in page.locator("figure.chart canvas").all():
            box = canvas.bounding_box()
            assert box["x"] + box["width"] <= 690.0
            assert box["width"] > 300.0
        assert page.locator("#time").inner_text() == "12.0 s"
        picture = seen.look(page)
        for told in ("with, without", "CRH3 of Xie et al. 2019", "2023-11-14 22:13:20 UTC"):
            assert picture.has(told), told
        assert all(button.is_visible() for button in page.locator("td button").all()), "when each braking began"
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert troubles == []


@pytest.mark.parametrize("look", ["light", "dark"])
def test_paper_is_drawn_for_at_once(hour: str, look: str) -> None:
    """Before: Firefox printed charts as wide as the screen, of a dark page in pale lines; tables were cut off."""
    with browser.open_page(**browser.LOOKS[look]) as (page, troubles):
        page.goto(hour)
        widths, line, paper = page.evaluate(
            "dispatchEvent(new Event('beforeprint')),"
            " [[...document.querySelectorAll('canvas')].map((each) => each.width), ink('truth'), ink('paper')]"
        )
        assert set(widths) == {680}
        assert (line, paper) == ("rgb(17, 17, 17)", "rgb(255, 255, 255)")
        assert page.evaluate(CUT_OFF) == []
        assert troubles == []

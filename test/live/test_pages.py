# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The pages in a real browser: they draw without a complaint, and follow the slider and the stream."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from test_live_view import STATUS, S, estimate
from test_picture import TRUTH, record

from adhesion_node.core.atp.received import TrainState
from adhesion_node.live.view import View
from adhesion_node.report.__main__ import main
from adhesion_node.wire.topics import POSITION

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")
server = pytest.importorskip("adhesion_node.live.server", reason="the extra `live` is not installed")


@pytest.fixture
def report(tmp_path: Path) -> str:
    """Return the address of a report of two runs, the second without truth: 80 m/s, 2 m/s^2 slower each second."""
    bags = [str(record(tmp_path / "with")), str(record(tmp_path / "without", *TRUTH))]
    assert main([*bags, "--output", str(tmp_path / "report"), "--target", "180"]) == 0
    return (tmp_path / "report" / "report.html").as_uri()


def test_the_report_draws_every_chart_of_every_run(report: str) -> None:
    with browser.open_page() as (page, troubles):
        page.goto(report)
        assert page.locator("figure.chart").count() == 12
        assert page.locator("section.run h2").all_inner_texts() == ["with", "without"]
        assert page.locator("section.run").nth(0).locator("path.line.truth").count() > 2
        for line in page.locator("section.run:first-child path.line.identified").all():
            assert "NaN" not in (line.get_attribute("d") or "NaN")
        assert page.locator(".bands .adhesion_limited").count() == 10
        assert troubles == []


def test_a_chart_is_drawn_in_the_size_that_it_has_and_over_the_range_of_its_values(tmp_path: Path) -> None:
    assert main([str(record(tmp_path / "bag", *TRUTH)), "--output", str(tmp_path / "report")]) == 0
    with browser.open_page() as (page, troubles):
        page.goto((tmp_path / "report" / "report.html").as_uri())
        for picture in page.locator("figure.chart > svg").all():
            box = picture.bounding_box()
            assert box is not None
            assert float((picture.get_attribute("viewBox") or "").split()[2]) == pytest.approx(box["width"], abs=1.5)
        adhesion = page.locator("figure.chart", has_text="Adhesion coefficient")
        assert max(map(float, adhesion.locator("text.y").all_text_contents())) == 0.08  # 0.09 is the largest value
        assert troubles == []


def test_the_slider_moves_the_present_of_all_runs(report: str) -> None:
    with browser.open_page() as (page, troubles):
        page.goto(f"{report}#t=12")
        for readout in page.locator(".readout").all():
            assert readout.inner_text().startswith("201.6 km/h")  # 80 - 2 * 12 m/s
        curve = page.locator("figure.chart path.line.fixed").first
        before, cursor = curve.get_attribute("d"), page.locator("path.cursor").nth(1).get_attribute("d")
        page.locator("#slider").fill("5")
        assert page.locator("#time").inner_text() == "5 s"
        for readout in page.locator(".readout").all():
            assert readout.inner_text().startswith("252.0 km/h")
        assert curve.get_attribute("d") != before
        assert page.locator("path.cursor").nth(1).get_attribute("d") != cursor
        assert troubles == []


def test_the_report_needs_nothing_but_itself(report: str) -> None:
    asked: list[str] = []
    with browser.open_page() as (page, troubles):
        page.on("request", lambda request: asked.append(request.url))
        page.goto(report)
        page.locator("summary").click()
        assert page.locator("details table tr").count() > 30
        assert troubles == []
    assert asked == [report]


def test_the_live_page_follows_the_stream() -> None:
    view = View()
    served = server.Server("127.0.0.1", 0, lambda: view.parts(0.2), 0.05)
    try:
        with browser.open_page() as (page, troubles):
            page.goto(served.url)
            state = page.locator("#state")
            state.get_by_text("waiting for the estimator").wait_for()
            view.heard(POSITION, 0.0)
            estimate(view, 0)
            estimate(view, 7, mu=0.09)
            view.supervised(STATUS, "above the permitted speed")
            page.get_by_text("OVERSPEED: above the permitted speed").wait_for()
            page.get_by_text("identified μ̂ 0.0900").wait_for()
            assert state.inner_text() == "7 s"
            assert page.locator("#dial svg").get_attribute("aria-label") == "speed 288 km/h"
            assert page.locator("#dial .arc").count() == 4  # up to the target, permitted, warning, intervention
            limits = page.locator("#limits td:last-child").all_inner_texts()
            assert limits[1:5] == ["180 km/h", "184 km/h", "187 km/h", "194 km/h"]
            assert page.locator("#inputs td.good").count() == 1
            assert page.locator("#inputs td.never").count() == 5
            left = page.locator("#gauge .identified").get_attribute("style") or ""
            assert re.search(r"left: ?45(\.00)?%", left)  # 0.09 on a scale to 0.2
            view.train(TrainState(1009 * S, 900.0, 50.0))
            state.get_by_text("9 s").wait_for()
            assert page.locator("#dial svg").get_attribute("aria-label") == "speed 180 km/h"
            view.end(1.0)
            state.get_by_text("the run has ended").wait_for()
            assert troubles == []
    finally:
        served.close()


def test_the_live_page_says_when_the_program_has_gone() -> None:
    served = server.Server("127.0.0.1", 0, lambda: View().parts(0.0), 0.05)
    try:
        with browser.open_page() as (page, _):
            page.goto(served.url)
            page.get_by_text("waiting for the estimator").wait_for()
            served.close()
            page.get_by_text("connection lost").wait_for()
    finally:
        served.close()

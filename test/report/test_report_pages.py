# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The report in a real browser: by what it says and what its charts hold."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from test_picture import TRUTH, record

from adhesion_node.report.__main__ import main

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")


@pytest.fixture(autouse=True, scope="module")
def chromium() -> Iterator[None]:
    with browser.launched():
        yield


@pytest.fixture
def report(tmp_path: Path) -> str:
    """Return the address of a report of two runs, the second without truth: 80 m/s, 2 m/s^2 slower each second."""
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
            assert readout.inner_text().startswith("201.6 km/h")  # 80 - 2 * 12 m/s
        present = page.locator(".present").nth(1)
        before = present.get_attribute("style")
        page.locator("#slider").fill("5")
        assert page.locator("#time").inner_text().startswith("5")
        for readout in page.locator(".readout").all():
            assert readout.inner_text().startswith("252.0 km/h")
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

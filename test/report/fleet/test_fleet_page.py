# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The report of a table of brakings in a real browser: by what it says and what its chart holds."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest
import seen
from test_fleet import BRAKINGS, DATES, rail

from adhesion_node.report.__main__ import main

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")


pytestmark = pytest.mark.usefixtures("chromium")


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the address of a report of three brakings and a map."""
    tmp_path = tmp_path_factory.mktemp("report")
    table = tmp_path / "brakings.parquet"
    pd.DataFrame(BRAKINGS).to_parquet(table, index=False)
    assert main([str(table), str(rail(tmp_path / "rail.csv")), "--output", str(tmp_path / "report")]) == 0
    return (tmp_path / "report" / "report.html").as_uri()


def rows(page: Any, table: int) -> list[list[str]]:
    """Return the cells of a table of the page."""
    return [row.locator("td").all_inner_texts() for row in page.locator("table").nth(table).locator("tbody tr").all()]


def drawn(page: Any) -> dict[str, list[tuple[float, float]]]:
    """Return the points of each line of the chart."""
    series = page.evaluate("rail.plot.series.map((s, i) => [s.label, rail.plot.data[i]])")
    (_, places), *lines = series
    return {label: [(x, y) for x, y in zip(places, values, strict=True) if y is not None] for label, values in lines}


def test_the_page_says_what_the_brakings_showed(report: str) -> None:
    asked: list[str] = []
    with browser.open_page() as (page, troubles):
        page.on("request", lambda request: asked.append(request.url))
        page.goto(report)
        assert page.locator("h1").inner_text() == "3 brakings"
        assert dict(rows(page, 0)) == {
            "Brakings": "3",
            "Trains": "2",
            "Recordings": "2",
            "Time": "2023-11-14 22:13 to 2023-11-15 22:13",
            "Track": "1.0 to 9.1 km",
            "Adhesion identified": "in 2 of 3 brakings",
            "μ̂, median of these": "0.0850",
        }
        assert rows(page, 1) == [
            ["1.00 to 1.20 km", "0.0500", "0.0400", "7", "2", "1 of 2 dates", "2023-11-14"],
        ]
        days = rows(page, 2)
        assert [day[0] for day in days] == list(reversed(DATES))
        assert [day[2:] for day in days] == [["4", "0.1200", "0.1000"], ["3", "0.0500", "0.0400"]]
        first, _, last = rows(page, -1)
        assert first[:5] == ["2023-11-14 22:13:20", "unit_7", "1.00 → 1.25", "100 → 40", "0.00"]
        assert first[5:] == ["adhesion 80%, the brake 20%", "0.0500 ± 0.0010", "0.0450", "–", "0.0400", "500", "0"]
        assert last[5:10] == ["the brake 60%, nothing is claimed 40%", "–", "–", "0.1100", "0.1000"]
        assert troubles == []
    assert asked == [report]


def test_the_map_has_a_strip_for_each_date(report: str) -> None:
    with browser.open_page() as (page, troubles):
        page.goto(report)
        strips = page.locator("svg.strip")
        assert [strip.get_attribute("aria-label") for strip in strips.all()] == [
            "Rail on 2023-11-15: lowest μ̂ 0.1200",
            "Rail on 2023-11-14: lowest μ̂ 0.0500",
        ]
        new, old = (strip.locator("title").all_text_contents() for strip in strips.all())
        assert new == ["1.00 to 1.10 km: 0.1200", "1.00 to 1.10 km: 0.1100", "9.00 to 9.10 km: 0.1000"]
        assert old == ["1.00 to 1.20 km: 0.0500", "1.00 to 1.10 km: 0.0400", "1.10 to 1.20 km: 0.0550"]
        legend = page.locator(".legend span").all_inner_texts()
        assert legend == ["below 0.05", "0.05 to 0.0726", "0.0726 to 0.1", "0.1 to 0.15", "from 0.15"]
        strip, tile = strips.nth(1).bounding_box(), strips.nth(1).locator("rect").first.bounding_box()
        assert tile["width"] / strip["width"] == pytest.approx(200.0 / 8100.0, rel=0.1)
        colours = {
            rect.evaluate("(rect) => getComputedStyle(rect).fill") for rect in strips.nth(1).locator("rect").all()
        }
        assert len(colours) == 2, "below 0.05, and from there"
        assert troubles == []


def test_the_chart_has_the_date_and_place_that_were_chosen(report: str) -> None:
    with browser.open_page() as (page, troubles):
        page.goto(report)
        title = page.locator("figure.chart figcaption")
        assert title.inner_text() == "Adhesion over place, lowest of all dates"
        lines = drawn(page)
        assert lines["identified"] == [(1.0, 0.05), (1.099999, 0.05), (1.1, 0.065), (1.199999, 0.065)]
        assert lines["at least: what was used"] == [(9.0, 0.11), (9.099999, 0.11)]
        page.get_by_role("button", name=DATES[1], exact=True).click()
        assert title.inner_text() == f"Adhesion over place, {DATES[1]}"
        assert drawn(page)["identified"] == [(1.0, 0.12), (1.099999, 0.12)]
        page.get_by_role("button", name="1.00 to 1.20 km").click()
        assert page.locator("#date").input_value() == "all dates"
        assert page.evaluate("view.zoom") == [1.0, 1.7]
        page.get_by_role("button", name="2023-11-14 22:13:20").click()
        assert title.inner_text() == f"Adhesion over place, {DATES[0]}"
        page.locator("#date").select_option(DATES[1])
        assert title.inner_text() == f"Adhesion over place, {DATES[1]}"
        assert troubles == []


def test_paper_has_the_places_and_dates_that_are_buttons_on_the_screen(report: str) -> None:
    with browser.open_page(**browser.LOOKS["print"]) as (page, _):
        page.goto(report)
        browser.turn(page, "print")
        picture = seen.look(page)
        for told in ("1.00 to 1.20 km", *DATES, "2023-11-14 22:13:20"):
            assert picture.has(told), told
        assert page.evaluate("[...document.querySelectorAll('.scroll')].every((each) => each.scrollWidth <= 680)")


@pytest.mark.parametrize("look", browser.LOOKS)
def test_the_page_can_be_used_by_everybody(report: str, look: str) -> None:
    with browser.open_page(**browser.LOOKS[look], device_scale_factor=2) as (page, troubles):
        page.goto(report)
        browser.turn(page, look)
        browser.assert_accessible(page)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "columns are cut off"
        seen.assert_readable(seen.look(page))
        assert troubles == []

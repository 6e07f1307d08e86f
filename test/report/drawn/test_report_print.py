# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A report on paper, as a real browser prints it."""

from __future__ import annotations

import pytest
import seen
from reports import an_hour, two_runs

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")


pytestmark = pytest.mark.usefixtures("chromium")

CUT_OFF = (
    "[...document.querySelectorAll('.scroll')].filter((each) => each.scrollWidth > 680).map((each) => each.innerText)"
)
"""The tables that are wider than the paper."""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> str:
    return two_runs(tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module")
def hour(tmp_path_factory: pytest.TempPathFactory) -> str:
    return an_hour(tmp_path_factory.mktemp("hour"))


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

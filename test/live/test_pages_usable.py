# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The live page in a real browser: it can be read by everybody, heard, and seen at once on a laptop."""

from __future__ import annotations

import pytest
from pages import browser, line
from told_view import estimate

pytestmark = pytest.mark.usefixtures("chromium")


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
            shown.pass_until("NO DATA since")
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

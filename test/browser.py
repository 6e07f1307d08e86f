# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A real browser for the tests of the pages: Debian's chromium, steered by playwright; skips where there is none."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, sync_playwright

FLAGS = (
    *("--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
)
"""Runs as any user, draws without a graphics card and calls nobody on its own."""

LOOKS: dict[str, dict[str, Any]] = {
    "light": {},
    "dark": {"color_scheme": "dark"},
    "phone": {"viewport": {"width": 390, "height": 844}},
    "print": {"viewport": {"width": 700, "height": 1000}},
    "forced colours": {"forced_colors": "active"},
    "dark forced colours": {"forced_colors": "active", "color_scheme": "dark"},
}
"""How a page may be looked at: what `open_page` and then `turn` are given."""

TIMEOUT_MS = 20_000.0


_running: list[Browser] = []


@contextmanager
def launched() -> Iterator[Browser]:
    """Start the browser, for all pages that are opened meanwhile: no other event loop can run in this thread."""
    if _running:
        yield _running[-1]
        return
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("no chromium on the PATH: apt install chromium")
    with sync_playwright() as playwright, playwright.chromium.launch(executable_path=chromium, args=FLAGS) as browser:
        _running.append(browser)
        try:
            yield browser
        finally:
            _running.remove(browser)


@contextmanager
def open_page(**context: Any) -> Iterator[tuple[Page, list[str]]]:
    """Open an empty page of 1400 x 1000 pixels, or as `context` says; the list gathers what goes wrong in it.

    Wrong is an error or a warning on the console, an uncaught exception, and a request that fails.
    """
    troubles: list[str] = []
    with launched() as browser, browser.new_context(**{"viewport": {"width": 1400, "height": 1000}, **context}) as own:
        page = own.new_page()
        page.set_default_timeout(TIMEOUT_MS)
        page.on("pageerror", lambda error: troubles.append(str(error)))
        page.on("requestfailed", lambda request: troubles.append(f"{request.url}: {request.failure}"))
        page.on("console", lambda said: troubles.append(said.text) if said.type in ("error", "warning") else None)
        yield page, troubles


def turn(page: Page, look: str) -> None:
    """Bring an open page of `LOOKS` into its look: a printer tells the page first."""
    if look == "print":
        page.emulate_media(media="print")
        page.evaluate("dispatchEvent(new Event('beforeprint'))")


def assert_accessible(page: Page) -> None:
    """Hold the page against the rules of WCAG 2.2, levels A and AA, as far as axe-core can tell."""
    wcag = {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]}
    found = Axe().run(page, options={"runOnly": wcag})
    assert found.violations_count == 0, found.generate_report()

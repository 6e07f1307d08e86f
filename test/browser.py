# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A real browser for the tests of the pages: Debian's chromium, steered by playwright; skips where there is none."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Page, sync_playwright

FLAGS = (
    *("--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
)
"""Runs as any user, draws without a graphics card and calls nobody on its own."""

TIMEOUT_MS = 20_000.0


@contextmanager
def open_page() -> Iterator[tuple[Page, list[str]]]:
    """Open an empty page of 1400 x 1000 pixels; the list gathers what goes wrong in it.

    Wrong is an error or a warning on the console, an uncaught exception, and a request that fails.
    """
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("no chromium on the PATH: apt install chromium")
    troubles: list[str] = []
    with sync_playwright() as playwright, playwright.chromium.launch(executable_path=chromium, args=FLAGS) as browser:
        page = browser.new_page(viewport={"width": 1400, "height": 1000})
        page.set_default_timeout(TIMEOUT_MS)
        page.on("pageerror", lambda error: troubles.append(str(error)))
        page.on("requestfailed", lambda request: troubles.append(f"{request.url}: {request.failure}"))
        page.on("console", lambda said: troubles.append(said.text) if said.type in ("error", "warning") else None)
        yield page, troubles

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The live page in a real browser, with clocks that the test sets: the line's, and the page's own, which stands."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from told_view import STATUS

from adhesion_node.live.view import View
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import ATP_STATUS, BRAKING_CURVE, MU, POSITION, STATE

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")
server = pytest.importorskip("adhesion_node.live.server", reason="the extra `live` is not installed")


SHOWN = (STATE, MU, BRAKING_CURVE, ATP_STATUS, POSITION)

STANDS = "window.passed_ms = 0; performance.now = () => window.passed_ms"
"""A busy machine may send nothing for a second: the page would rightly say that there are no data."""

STEP_MS = 500
TIMEOUT_S = 20.0


class Line:
    """A view whose clock the test sets, and its page.

    What the view has taken is served all at once when the test waits: the server, which looks every 50 ms, would else
    come between two of its parts.
    """

    def __init__(self) -> None:
        self.view, self.now_s = View(), 0.0
        self.tell()
        self.served = server.Server("127.0.0.1", 0, lambda: dict(self._told), 0.05)
        self.page: Any = None

    def tell(self) -> None:
        """Serve from now on what the view shows now."""
        self._told = self.view.parts(self.now_s)

    def hear(self, *topics: Topic) -> None:
        for topic in topics or SHOWN:
            self.view.heard(topic, self.now_s)

    def says(self, where: str) -> str:
        return str(self.page.locator(where).text_content())

    def wait(self, text: str, **options: Any) -> None:
        self.tell()
        self.page.get_by_text(text, **options).first.wait_for()

    def pass_until(self, text: str) -> None:
        """Let the page's own time go on, step by step, until the page says so; messages may still be on their way."""
        deadline = time.monotonic() + TIMEOUT_S
        step = "([step, text]) => { passed_ms += step; draw(); return document.body.innerText.includes(text) }"
        while not self.page.evaluate(step, [STEP_MS, text]):
            assert time.monotonic() < deadline, text

    def level(self, level: str, **values: float) -> None:
        said = STATUS | {"level": level} | {name: str(value) for name, value in values.items()}
        self.view.supervised(said, level.lower())
        self.hear()


@contextmanager
def line(**context: Any) -> Iterator[Line]:
    """Serve a view and open it; nothing may go wrong in the page but that the server has gone."""
    made = Line()
    try:
        with browser.open_page(**context) as (page, troubles):
            made.page = page
            page.add_init_script(STANDS)
            page.goto(made.served.url)
            page.get_by_text("waiting for the estimator").wait_for()
            yield made
            assert [trouble for trouble in troubles if "ERR_CONNECTION_REFUSED" not in trouble] == []
    finally:
        made.served.close()

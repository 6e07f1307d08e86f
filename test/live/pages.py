# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The live page in a real browser, with a clock that the test sets."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from test_live_view import STATUS

from adhesion_node.live.view import View
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import ATP_STATUS, BRAKING_CURVE, MU, POSITION, STATE

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")
server = pytest.importorskip("adhesion_node.live.server", reason="the extra `live` is not installed")


SHOWN = (STATE, MU, BRAKING_CURVE, ATP_STATUS, POSITION)


class Line:
    """A view whose clock the test sets, and its page."""

    def __init__(self, page: Any, served: Any, view: View) -> None:
        self.page, self.view, self.served = page, view, served
        self.now_s = 0.0

    def hear(self, *topics: Topic) -> None:
        for topic in topics or SHOWN:
            self.view.heard(topic, self.now_s)

    def says(self, where: str) -> str:
        return str(self.page.locator(where).text_content())

    def wait(self, text: str, **options: Any) -> None:
        self.page.get_by_text(text, **options).first.wait_for()

    def level(self, level: str, **values: float) -> None:
        said = STATUS | {"level": level} | {name: str(value) for name, value in values.items()}
        self.view.supervised(said, level.lower())
        self.hear()


@contextmanager
def line(**context: Any) -> Iterator[Line]:
    """Serve a view and open it; nothing may go wrong in the page but that the server has gone."""
    view = View()
    made: list[Line] = []
    served = server.Server("127.0.0.1", 0, lambda: view.parts(made[0].now_s if made else 0.0), 0.05)
    try:
        with browser.open_page(**context) as (page, troubles):
            made.append(Line(page, served, view))
            page.goto(served.url)
            page.get_by_text("waiting for the estimator").wait_for()
            yield made[0]
            assert [trouble for trouble in troubles if "ERR_CONNECTION_REFUSED" not in trouble] == []
    finally:
        served.close()

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A viewer of the live page without a browser: a web socket, and the parts as the page's script keeps them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from aiohttp import ClientSession, ClientWebSocketResponse, WSMsgType

TIMEOUT_S = 60.0


class Viewer:
    """Receives messages; `bytes` counts them, `parts` is what they add up to."""

    def __init__(self, loop: asyncio.AbstractEventLoop, socket: ClientWebSocketResponse) -> None:
        self._loop = loop
        self._socket = socket
        self.bytes = 0
        self.parts: dict[str, Any] = {}

    def receive(self) -> dict[str, Any] | None:
        """Return the next message; None once the server has closed."""
        got = self._loop.run_until_complete(asyncio.wait_for(self._socket.receive(), TIMEOUT_S))
        if got.type is not WSMsgType.TEXT:
            return None
        self.bytes += len(got.data)
        message: dict[str, Any] = got.json()
        if "all" in message:
            self.parts = {}
        self.parts |= message.get("all", {}) | message.get("set", {})
        for name, entries in message.get("change", {}).items():
            self.parts[name] = self.parts[name] | entries
        for name, rows in message.get("add", {}).items():
            self.parts[name] = [*self.parts[name], *rows]
        return message

    def until(self, seen: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Receive until the parts show something; at most so many messages as come in `TIMEOUT_S`."""
        deadline = self._loop.time() + TIMEOUT_S
        while not seen(self.parts):
            assert self._loop.time() < deadline, self.parts
            assert self.receive() is not None, "the server has closed"
        return self.parts


@contextmanager
def watching(url: str, **headers: str) -> Iterator[Viewer]:
    """Open a viewer; aiohttp's errors go through."""
    loop = asyncio.new_event_loop()

    async def open_socket() -> tuple[ClientSession, ClientWebSocketResponse]:
        session = ClientSession(headers=headers)
        try:
            return session, await session.ws_connect(f"{url}events")
        except BaseException:
            await session.close()
            raise

    session, socket = loop.run_until_complete(open_socket())
    try:
        yield Viewer(loop, socket)
    finally:
        loop.run_until_complete(socket.close())
        loop.run_until_complete(session.close())
        loop.close()

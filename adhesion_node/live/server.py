# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The web server of the live page, in a thread of its own: the page itself and one stream of events for each viewer."""

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import Any

from aiohttp import web

from ..web import as_json, page

CLOSING_S = 1.0
"""Longest wait for open streams at the end."""

Parts = Callable[[], dict[str, Any]]


class Server:
    """Serves the page; a viewer is sent every `period_s` those of the `parts` that have changed.

    `parts` is called from the server's thread and must not block. Raises OSError when the address is taken.
    """

    def __init__(self, host: str, port: int, parts: Parts, period_s: float) -> None:
        self._parts = parts
        self._period_s = period_s
        self._stop = asyncio.Event()
        self.viewers = 0
        """Pages that are open now."""
        started: Future[tuple[asyncio.AbstractEventLoop, str]] = Future()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve(host, port, started)), name="live page")
        self._thread.start()
        self._loop, self.url = started.result()

    def close(self) -> None:
        """End the streams and the thread; closing again does nothing."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()

    async def _serve(self, host: str, port: int, started: Future[tuple[asyncio.AbstractEventLoop, str]]) -> None:
        application = web.Application()
        application.add_routes([web.get("/", _page), web.get("/events", self._events)])
        runner = web.AppRunner(application, access_log=None, shutdown_timeout=CLOSING_S)
        await runner.setup()
        try:
            await web.TCPSite(runner, host, port).start()
        except OSError as error:
            started.set_exception(OSError(error.errno, f"{host}:{port}: {error.strerror}"))
        else:
            number = runner.addresses[0][1]
            started.set_result((asyncio.get_running_loop(), f"http://{f'[{host}]' if ':' in host else host}:{number}/"))
            await self._stop.wait()
        finally:
            await runner.cleanup()

    async def _events(self, request: web.Request) -> web.StreamResponse:
        """Server-sent events: what has changed since the last one, all of it at first."""
        response = web.StreamResponse(headers={"Content-Type": "text/event-stream", "Cache-Control": "no-store"})
        await response.prepare(request)
        sent: dict[str, Any] = {}
        self.viewers += 1
        try:
            with suppress(ConnectionError):  # the viewer has gone
                while not self._stop.is_set():
                    parts = self._parts()
                    news = {name: part for name, part in parts.items() if name not in sent or sent[name] != part}
                    if news:
                        await response.write(f"data: {as_json(news)}\n\n".encode())
                    sent = parts
                    await asyncio.sleep(self._period_s)
        finally:
            self.viewers -= 1
        return response


async def _page(_: web.Request) -> web.Response:
    return web.Response(text=page("live"), content_type="text/html")

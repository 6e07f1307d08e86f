# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The web server of the live page, in a thread of its own: the page itself, and a socket to each viewer.

Web sockets, as a browser opens no more than six streams of events to one host in all its tabs.
"""

import asyncio
import errno
import os
import threading
from collections.abc import Awaitable, Callable
from concurrent.futures import Future

from aiohttp import HttpVersion11, WSCloseCode, web

from ..web import POLICY, page
from .feed import Feed, Parts
from .guard import LOG, REQUEST_S, Guard, allowed

CLOSING_S = 1.0
"""Longest wait for open sockets at the end."""

BEAT_S = 0.3
"""Longest silence towards a viewer: its page says after 1 s that there is no data."""

BEHIND = 50
"""Messages that wait for a viewer until it is given up: it comes back and is sent the whole."""

HEADERS = {
    "Content-Security-Policy": f"{POLICY}; connect-src 'self'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Server:
    """Serves the page; all viewers are sent every `period_s` what has changed of the `parts`.

    `parts` is called from the server's thread and must not block. Raises ValueError when the address is taken.
    """

    def __init__(self, host: str, port: int, parts: Parts, period_s: float) -> None:
        self._feed = Feed(parts)
        self._host = host
        self._period_s = period_s
        self._stop = asyncio.Event()
        self._queues: set[asyncio.Queue[str | None]] = set()
        started: Future[tuple[asyncio.AbstractEventLoop, str]] = Future()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve(host, port, started)), name="live page")
        self._thread.start()
        self._loop, self.url = started.result()

    @property
    def viewers(self) -> int:
        """Pages that are open now."""
        return len(self._queues)

    def close(self) -> None:
        """End the sockets and the thread; closing again does nothing."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()

    async def _serve(self, host: str, port: int, started: Future[tuple[asyncio.AbstractEventLoop, str]]) -> None:
        application = web.Application(middlewares=[self._checked])
        application.add_routes([web.get("/", _page), web.get("/events", self._events)])
        runner = web.AppRunner(
            application, access_log=None, logger=LOG, shutdown_timeout=CLOSING_S, keepalive_timeout=REQUEST_S
        )
        await runner.setup()
        assert runner.server is not None
        loop, self._guard = asyncio.get_running_loop(), Guard(runner.server)
        loop.set_exception_handler(self._guard.fault)
        try:
            listening = await loop.create_server(self._guard, host, port)
        except OSError as error:
            started.set_exception(ValueError(_refused(error, host, port)))
        else:
            number = listening.sockets[0].getsockname()[1]
            started.set_result((loop, f"http://{f'[{host}]' if ':' in host else host}:{number}/"))
            await self._broadcast()
            listening.close()
        finally:
            await runner.cleanup()

    async def _broadcast(self) -> None:
        silent_s = 0.0
        while not self._stop.is_set():
            if self._queues:
                news = self._feed.news()
                silent_s += self._period_s
                if news.count(":") > 1 or silent_s >= BEAT_S:
                    silent_s = 0.0
                    for queue in self._queues:
                        _give(queue, news)
            await asyncio.sleep(self._period_s)
        for queue in self._queues:
            _give(queue, None)

    async def _events(self, request: web.Request) -> web.StreamResponse:
        """Text messages in JSON: the whole at first, then news."""
        response = web.WebSocketResponse(timeout=CLOSING_S, heartbeat=10.0, max_msg_size=1024)
        await response.prepare(request)
        queue: asyncio.Queue[str | None] = asyncio.Queue(BEHIND)
        queue.put_nowait(self._feed.whole())
        self._queues.add(queue)
        listening = asyncio.create_task(_until_gone(response, queue))
        try:
            while (message := await queue.get()) is not None:
                await response.send_str(message)
        except ConnectionError:
            pass  # the viewer has gone
        finally:
            self._queues.discard(queue)
            listening.cancel()
            await response.close(code=WSCloseCode.GOING_AWAY)
        return response

    @web.middleware
    async def _checked(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Answer those alone who ask for this server by a name of its own, and no other site's script."""
        self._guard.asked(request)
        if "Host" not in request.headers and request.version >= HttpVersion11:  # aiohttp before 3.14 lets it pass
            raise web.HTTPBadRequest(text="no Host\n")
        own = {None, f"http://{request.host}", f"https://{request.host}"}
        if not allowed(request.host, self._host) or request.headers.get("Origin") not in own:
            raise web.HTTPForbidden(text=f"Host = {request.host!r}: ask for {self.url} or by an address\n")
        return await handler(request)


def _refused(error: OSError, host: str, port: int) -> str:
    """Why nothing can be served at the address, and what to do."""
    number = error.errno or errno.EADDRNOTAVAIL  # Python 3.13 leaves it out where no address is of this machine
    why = os.strerror(number) if number > 0 else error.strerror
    if number in (errno.EADDRINUSE, errno.EACCES):
        return f"port = {port}: {host}:{port}: {why}: give another --port, or --port 0 for any that is free"
    return f"host = {host}: {why}: give --host an address of this machine"


def _give(queue: asyncio.Queue[str | None], message: str | None) -> None:
    """Put a message in; a viewer that takes none is given up."""
    if queue.full():
        while not queue.empty():
            queue.get_nowait()
        message = None
    queue.put_nowait(message)


async def _until_gone(response: web.WebSocketResponse, queue: asyncio.Queue[str | None]) -> None:
    """Viewers say nothing: what comes from one is that it has gone."""
    await response.receive()
    _give(queue, None)


async def _page(_: web.Request) -> web.Response:
    response = web.Response(text=page("live"), content_type="text/html", headers=HEADERS)
    response.force_close()
    return response

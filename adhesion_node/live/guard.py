# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Who may connect to the live page: bounded in number and in the time that a request takes, and by a name of ours."""

import asyncio
import errno
import logging
import socket
from contextlib import suppress
from ipaddress import ip_address
from math import inf
from typing import Any, cast

from aiohttp import web
from aiohttp.http_exceptions import HttpProcessingError

MOST_CONNECTIONS = 64
"""Open at one time; the next are closed at once, so that no file descriptor is missing elsewhere."""

REQUEST_S = 5.0
"""Longest time from the connection to the whole request, and of a connection that asks for nothing more."""

TELL_S = 60.0
"""Time between two lines about missing file descriptors."""

LOG = logging.getLogger(__name__)
"""Of faults on this side: what a client sends that is no HTTP, it is told itself (400), and nobody else."""

LOG.addFilter(lambda record: not (record.exc_info and isinstance(record.exc_info[1], HttpProcessingError)))


class Guard:
    """Makes the protocol of every connection to a server."""

    def __init__(self, server: web.Server) -> None:
        self._server = server
        self._silent: set[asyncio.BaseProtocol] = set()
        self._told_s = -inf

    def __call__(self) -> asyncio.BaseProtocol:
        """Answer a new connection, which is closed if it does not ask for anything in time."""
        if len(self._server.connections) >= MOST_CONNECTIONS:
            return _Refused()
        protocol = self._server()
        self._silent.add(protocol)
        asyncio.get_running_loop().call_later(REQUEST_S, self._close_idle, protocol)
        return protocol

    def asked(self, request: web.Request) -> None:
        """A whole request has come."""
        self._silent.discard(request.protocol)

    def fault(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Tell what goes wrong in the loop; in a line where no connection can be taken, which is tried every second."""
        error = context.get("exception")
        if isinstance(error, ValueError) and "protocol" in context:
            return  # bytes that aiohttp before 3.14.4 cannot read: an address that is none; the connection is closed
        if not isinstance(error, OSError) or error.errno not in (errno.EMFILE, errno.ENFILE):
            loop.default_exception_handler(context)
        elif loop.time() - self._told_s > TELL_S:
            self._told_s = loop.time()
            LOG.warning("no connection is taken: %s; see ulimit -n", error.strerror)

    def _close_idle(self, protocol: web.RequestHandler) -> None:
        if protocol in self._silent:
            self._silent.discard(protocol)
            if protocol.transport is not None:
                protocol.transport.abort()


class _Refused(asyncio.Protocol):
    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        cast(asyncio.Transport, transport).abort()


def allowed(host: str, served: str) -> bool:
    """Whether a Host header names this server: by address, which no foreign name resolves to, or by a name of its own.

    >>> [allowed(host, "127.0.0.1") for host in ("127.0.0.1:8080", "localhost", "[::1]:80", "evil.example:8080", "")]
    [True, True, True, False, False]
    """
    name = host.rpartition("]")[0].lstrip("[") or host.partition(":")[0]
    own = socket.gethostname().lower()
    if name.lower() in ("localhost", served.lower(), own, f"{own}.local"):
        return True
    with suppress(ValueError):
        return bool(ip_address(name))
    return False


def exposure(served: str) -> str:
    """What to warn of; empty where the page is for this machine alone.

    >>> exposure("127.0.0.1"), exposure("0.0.0.0")[:15]
    ('', '--host 0.0.0.0:')
    """
    with suppress(ValueError):
        if ip_address(served).is_loopback:
            return ""
    if served == "localhost":
        return ""
    return f"--host {served}: everybody who reaches this machine sees the page, it has no password; leave --host out"

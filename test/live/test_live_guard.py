# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Who is served by the live page and who is not: foreign names, other sites, what is no request, and too many."""

from __future__ import annotations

import socket
from contextlib import ExitStack, suppress
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from rclpy.context import Context
from test_live import TIMEOUT_S, live, viewer

from adhesion_node.live.node import Live

__all__ = ["live"]

aiohttp = pytest.importorskip("aiohttp", reason="the extra `live` is not installed")
guard, server = (pytest.importorskip(f"adhesion_node.live.{name}") for name in ("guard", "server"))


def status_of(url: str, **headers: str) -> int:
    """The code that the page answers with."""
    try:
        with urlopen(Request(url, headers=headers), timeout=TIMEOUT_S) as response:
            return int(response.status)
    except HTTPError as error:
        return error.code


@pytest.mark.parametrize("path", ["", "events"])
def test_who_asks_by_a_foreign_name_is_refused(live: Live, path: str) -> None:
    """A name that an attacker has made to mean this machine: any Host was answered before."""
    assert status_of(f"{live.server.url}{path}", Host="evil.example") == 403
    assert status_of(live.server.url) == status_of(live.server.url, Host="localhost:8080") == 200


def test_another_sites_script_cannot_watch(live: Live) -> None:
    with pytest.raises(aiohttp.WSServerHandshakeError), viewer.watching(live.server.url, Origin="http://evil.example"):
        pass
    for nobody in ("null", "file://", "data:"):  # a frame of any site that is shut in says so
        with pytest.raises(aiohttp.WSServerHandshakeError), viewer.watching(live.server.url, Origin=nobody):
            pass
    with viewer.watching(live.server.url, Origin=live.server.url.rstrip("/")) as watcher:
        assert watcher.receive()


def test_what_the_page_may_do_stands_in_the_headers(live: Live) -> None:
    with urlopen(live.server.url, timeout=TIMEOUT_S) as response:
        policy = response.headers["Content-Security-Policy"]
        assert response.headers["X-Content-Type-Options"] == "nosniff"
    assert "default-src 'none'" in policy
    assert "connect-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy


def test_a_request_that_never_ends_is_closed(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "REQUEST_S", 0.2)
    with socket.create_connection(("127.0.0.1", port_of(live)), TIMEOUT_S) as slow:
        slow.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n")
        with suppress(ConnectionError):
            assert slow.recv(1) == b""


@pytest.mark.parametrize(
    "request_",
    [
        b"GET / HTTP/9.x\r\nHost: localhost\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost localhost\r\n\r\n",
        b"GET / HTTP/1.1\r\n\r\n",
        b"GET http://[::1 HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET /" + b"a" * 10_000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
        b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Encoding: deflate\r\nContent-Length: 3\r\n\r\nabc",
    ],
)
def test_what_is_no_request_is_told_its_sender_alone(
    live: Live, caplog: pytest.LogCaptureFixture, request_: bytes
) -> None:
    """Each left aiohttp's traceback on stderr."""
    with socket.create_connection(("127.0.0.1", port_of(live)), TIMEOUT_S) as client:
        client.sendall(request_)
        answer = client.recv(12)
    closed = b"[::1 " in request_ and answer == b""  # by aiohttp before 3.14.4
    assert closed or answer in (b"HTTP/1.0 400", b"HTTP/1.1 400", b"HTTP/1.1 405")
    assert status_of(live.server.url) == 200
    assert caplog.text == ""


def test_a_fault_of_the_page_itself_is_told(
    live: Live, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "page", lambda name: 1 / 0)
    assert status_of(live.server.url) == 500
    assert "ZeroDivisionError" in caplog.text


def test_too_many_connections_are_closed_and_viewers_stay(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "MOST_CONNECTIONS", 3)
    with viewer.watching(live.server.url) as watcher, ExitStack() as stack:
        for _ in range(2):
            stack.enter_context(socket.create_connection(("127.0.0.1", port_of(live)), TIMEOUT_S))
        surplus = stack.enter_context(socket.create_connection(("127.0.0.1", port_of(live)), TIMEOUT_S))
        with suppress(ConnectionError):
            assert surplus.recv(1) == b""
        live.view.place(1.0)
        assert watcher.until(lambda parts: parts.get("place_m") == 1.0)


def test_a_page_for_everybody_is_warned_of(context: Context, capfd: pytest.CaptureFixture[str]) -> None:
    for host, said in (("127.0.0.1", 0), ("0.0.0.0", 1)):
        node = Live(host, 0, context=context)
        node.close()
        node.destroy_node()
        assert capfd.readouterr().err.count("everybody who reaches this machine sees the page") == said


def port_of(live: Live) -> int:
    return int(live.server.url.rsplit(":", 1)[1].strip("/"))

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The address of the live page: taken, of another machine, given back; and what is said where no page can be."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable

import pytest
from rclpy.context import Context

from adhesion_node.live.__main__ import main
from adhesion_node.live.node import Live
from adhesion_node.tools.demo import __main__ as demo

pytest.importorskip("aiohttp", reason="the extra `live` is not installed")


def test_a_closed_page_gives_its_address_back(context: Context) -> None:
    first = Live("127.0.0.1", 0, context=context)
    port = int(first.server.url.rsplit(":", 1)[1].strip("/"))
    first.close()
    first.destroy_node()
    second = Live("127.0.0.1", port, context=context)
    second.close()
    second.destroy_node()


@pytest.mark.parametrize("program", [main, lambda options: demo.main(["--live", *options])])
def test_a_taken_address_is_one_line_with_a_remedy_and_code_2(
    program: Callable[[list[str]], int], capfd: pytest.CaptureFixture[str]
) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert program(["--port", str(port)]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    said = f"port = {port}: 127.0.0.1:{port}: Address already in use: give another --port, or --port 0"
    assert said in line


def test_a_host_of_another_machine_is_one_line_with_a_remedy(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["--host", "192.0.2.1", "--port", "0"]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("live: host = 192.0.2.1: Cannot assign requested address: give --host an address of")


def test_without_aiohttp_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, "adhesion_node.live.server", raising=False)
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    assert main(["--port", "0"]) == 2
    assert capfd.readouterr().err.strip() == "live: aiohttp is missing: pip install '.[live]'"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The programs that serve the live page: they end when they are told to, and say what they lack."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from threading import Timer
from typing import Any
from urllib.request import urlopen

import pytest

pytest.importorskip("aiohttp", reason="the extra `live` is not installed")
viewer = pytest.importorskip("viewer")

TIMEOUT_S = 20.0
START_S = 90.0
"""For a program that loads ROS and compiled code on a machine that is busy."""

FOREIGN = {"_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH"}
"""Marks of this process that a new one must not inherit."""


def start(code: str, **options: Any) -> subprocess.Popen[str]:
    environment = {name: value for name, value in os.environ.items() if name not in FOREIGN}
    return subprocess.Popen([sys.executable, "-c", code], env=environment, stderr=subprocess.PIPE, text=True, **options)


def served_at(process: subprocess.Popen[str]) -> str:
    """Return the address of the page, as the program says it; it chooses a port that no other program has."""
    assert process.stderr is not None
    late = Timer(START_S, process.kill)
    late.start()
    said = []
    try:
        for line in process.stderr:
            said.append(line)
            if found := re.search(r"open (http://127\.0\.0\.1:\d+/)", line):
                return found[1]
    finally:
        late.cancel()
    pytest.fail(f"nothing is served: {''.join(said)}")


def test_ctrl_c_ends_the_page_while_it_is_watched() -> None:
    process = start("import sys; from adhesion_node.main import live; sys.argv[1:] = ['--port', '0']; sys.exit(live())")
    try:
        with viewer.watching(served_at(process)) as watcher:
            watcher.receive()
            process.send_signal(signal.SIGINT)
            assert process.wait(TIMEOUT_S) == 0
        assert process.stderr is not None
        assert "Traceback" not in process.stderr.read()
    finally:
        process.kill()
        process.communicate()


DEMO = """
from dataclasses import replace
from adhesion_node.tools.demo import __main__ as demo
from adhesion_node.core.physics.track import LEVEL
from sim_node.train import scenario
from sim_node.train.scenario import SCENARIOS, Brake
cut = replace(SCENARIOS["tunnel_entry"], brake=Brake(1.0), track=LEVEL, end_s=3.0)
scenario.SCENARIOS = demo.SCENARIOS = {**SCENARIOS, "tunnel_entry": cut}
raise SystemExit(demo.main(["--live", "--port", "0"]))
"""


def test_the_live_demo_waits_for_a_viewer_runs_at_real_time_and_ends_by_ctrl_c(tmp_path: Path) -> None:
    process = start(DEMO, cwd=tmp_path, stdout=subprocess.DEVNULL)
    try:
        url = served_at(process)
        begun = time.monotonic()
        with viewer.watching(url) as watcher:
            seen = watcher.until(lambda parts: parts.get("ended"))
            assert time.monotonic() - begun > 0.9 * seen["train"]["t"], "faster than real time"
        assert 1.9 < seen["train"]["t"] <= 3.0  # from the first estimate to the end at 3 s
        assert [said["state"] for topic, said in seen["inputs"].items() if topic != "speed"] == ["heard"] * 6
        process.send_signal(signal.SIGINT)
        assert process.wait(TIMEOUT_S) == 0
    finally:
        process.kill()
        _, error = process.communicate()
    assert "Traceback" not in error
    assert (tmp_path / "adhesion_demo" / "bag" / "metadata.yaml").is_file()


SHORT_OF_FILES = """
import os, resource, sys
from adhesion_node.live.server import Server
server = Server("127.0.0.1", 0, dict, 0.1)
most = len(os.listdir("/proc/self/fd")) + 8
resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
print(server.url, flush=True)
sys.stdin.readline()
server.close()
"""
"""A page whose process may open a few files more."""


def test_at_the_limit_of_open_files_a_line_is_told_and_the_page_is_served_again_when_there_are_some() -> None:
    with start(SHORT_OF_FILES, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        address = ("127.0.0.1", int(url.rsplit(":", 1)[1].strip("/")))
        with ExitStack() as stack:
            for _ in range(40):
                stack.enter_context(socket.create_connection(address, TIMEOUT_S))
            waits = stack.enter_context(socket.create_connection(address, TIMEOUT_S))
            waits.settimeout(2.5)  # the loop tries again every second
            with suppress(TimeoutError):
                assert waits.recv(1) == b"", "a silent connection is answered"
        with urlopen(url, timeout=TIMEOUT_S) as response:
            assert response.status == 200
        _, err = process.communicate("\n", TIMEOUT_S)
    assert process.returncode == 0
    assert err == "no connection is taken: Too many open files; see ulimit -n\n"

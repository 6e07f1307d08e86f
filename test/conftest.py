# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What every test shares: a private ROS graph, a fresh context and executor, and bounded waiting.

The tests run on the tree's copy of the packages (`pythonpath` in pyproject.toml), and so do the programs that they
start, whichever copy is installed beside them.
"""

from __future__ import annotations

import fcntl
import gc
import os
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Protocol

import pytest

from adhesion_node.command.without_ros import REMEDY, is_of_ros

# Before numpy is loaded, which looks once: the matrices are small, and a second thread costs far more than it brings.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

try:
    import hypothesis
    import rclpy
    from hypothesis.configuration import set_hypothesis_home_dir
    from rclpy.context import Context
    from rclpy.executors import Executor, SingleThreadedExecutor

    from adhesion_node.core import Config
    from adhesion_node.core.bank import BANK
    from adhesion_node.core.estimator import warm_up
    from adhesion_node.core.methods import METHODS
except ModuleNotFoundError as error:
    missing = error.name or ""
    if missing.startswith(("adhesion_node", "sim_node")):
        raise
else:
    missing = ""

DOMAINS = range(1, 101)
ROOT = Path(__file__).resolve().parent.parent

PATIENCE_S = 60.0
"""Longest wait for what comes within seconds on a machine that has nothing else to do."""

_domain_locks: list[socket.socket] = []
_ros_home = pytest.StashKey[str]()


class SpinUntil(Protocol):
    """Type of the `spin_until` fixture."""

    def __call__(self, executor: Executor, predicate: Callable[[], object], timeout_s: float = PATIENCE_S) -> None: ...


def pytest_configure(config: pytest.Config) -> None:
    """Set the environment of this process and of those it starts, before the first context is made."""
    if missing:
        remedy = REMEDY if is_of_ros(missing) else "pip install '.[live,test]'"
        raise pytest.UsageError(f"{missing} is missing, without which no test runs: {remedy}")
    # The same examples in every run: what passes once, passes always. HYPOTHESIS_PROFILE=search looks for new ones.
    hypothesis.settings.register_profile("same", derandomize=True, deadline=None, max_examples=60)
    hypothesis.settings.register_profile("search", deadline=None, max_examples=3000, print_blob=True)
    hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))
    home = config.stash[_ros_home] = tempfile.mkdtemp(prefix="adhesion_node_test_")
    for name in ("ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER"):
        os.environ.pop(name, None)
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")
    os.environ["ROS_DOMAIN_ID"] = str(_claim_domain(29 * int(worker)))  # the blocks of workers lie far apart
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_HOME"] = home
    set_hypothesis_home_dir(os.path.join(home, "hypothesis"))
    os.environ["ROS_LOG_DIR"] = os.path.join(home, "log")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each of some hundred programs would translate the packages anew
    if config.getoption("dist", None) == "load":  # what tests of one file share is made once, and none ends long before
        config.option.dist = "worksteal"


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return half as many again as there are cores: tests of nodes wait more than they compute."""
    return 3 * (os.cpu_count() or 1) // 2


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the kernels once, before there are workers: in a fresh clone that takes longer than some tests wait."""
    if not hasattr(session.config, "workerinput"):
        with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
            list(pool.map(warm_up, (Config(method=method, identify_noise=True) for method in (BANK, *METHODS))))


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """Let the garbage collector pass over what is loaded for the tests: it is much, and stays."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the logs and give the domain back."""
    if _ros_home in config.stash:
        shutil.rmtree(config.stash[_ros_home], ignore_errors=True)
    _give_domain_back()


def _claim_domain(behind: int = 0) -> int:
    """Return a domain that no other test process of this machine holds: an abstract socket is freed by any exit."""
    for step in range(len(DOMAINS)):
        domain, lock = DOMAINS[(behind + step) % len(DOMAINS)], socket.socket(socket.AF_UNIX)
        try:
            lock.bind(f"\0adhesion_node_test_domain_{domain}")
        except OSError:
            lock.close()
            continue
        _domain_locks.append(lock)
        return domain
    raise pytest.UsageError(f"all {len(DOMAINS)} ROS domains are held by other test runs: wait for one to end")


def _give_domain_back() -> None:
    while _domain_locks:
        _domain_locks.pop().close()


def made_once(temporary: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """Return a folder that one worker fills by `make` for all: the tests of a file may be divided among them."""
    base = temporary.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = base / name
    with (base / f"{name}.made").open("a+", encoding="utf-8") as made:
        fcntl.flock(made, fcntl.LOCK_EX)  # until it is closed
        if not made.seek(0, os.SEEK_END):
            shutil.rmtree(folder, ignore_errors=True)  # of a worker that failed
            folder.mkdir()
            make(folder)
            made.write("made")
    return folder


@pytest.fixture
def fresh_domain() -> None:
    """Move this test to the next domain: a program that another one killed is still seen in its own for 20 s."""
    behind = int(os.environ["ROS_DOMAIN_ID"])
    _give_domain_back()
    os.environ["ROS_DOMAIN_ID"] = str(_claim_domain(behind))


@pytest.fixture
def started(fresh_domain: None) -> Iterator[list[subprocess.Popen[str]]]:
    """Return a list for programs that end with the test at the latest."""
    programs: list[subprocess.Popen[str]] = []
    yield programs
    for program in programs:
        program.kill()
        program.communicate()


@pytest.fixture
def context(fresh_domain: None) -> Iterator[Context]:
    """Return an initialised context of this test alone; it is shut down after the test."""
    fresh = Context()
    rclpy.init(context=fresh)
    yield fresh
    fresh.try_shutdown()


@pytest.fixture
def executor(context: Context) -> Iterator[SingleThreadedExecutor]:
    """Return an executor on `context`; nodes that are still in it after the test are destroyed."""
    single = SingleThreadedExecutor(context=context)
    yield single
    nodes = list(single.get_nodes())
    single.shutdown()
    for node in nodes:
        node.destroy_node()


@pytest.fixture(scope="module")
def chromium() -> Iterator[None]:
    """One browser for all pages of a module."""
    browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")
    with browser.launched():
        yield


@pytest.fixture
def spin_until() -> SpinUntil:
    """Return the function `spin_until(executor, predicate, timeout_s=PATIENCE_S)`.

    It spins until `predicate()` is true and fails the test when that takes longer than `timeout_s` seconds.
    """
    return _spin_until


def _spin_until(executor: Executor, predicate: Callable[[], object], timeout_s: float = PATIENCE_S) -> None:
    deadline = time.monotonic() + timeout_s
    while not predicate():
        remaining = deadline - time.monotonic()
        if remaining <= 0.0:
            raise AssertionError(f"still waiting after {timeout_s:g} s for {predicate}")
        executor.spin_once(timeout_sec=min(remaining, 0.05))

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tasks of the studies: cache, workers, a Dask cluster, and ends of every kind."""

from __future__ import annotations

import argparse
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from adhesion_node.command import engines, running
from adhesion_node.command.running import Arrays, Running, Task, file_name, load, run_all, save
from adhesion_node.study.__main__ import main
from adhesion_node.study.he.runs import VARYING_ETA, Experiment
from adhesion_node.study.trial.estimators import Estimator
from adhesion_node.study.trial.trials import Trials
from adhesion_node.study.trial.world import World

if TYPE_CHECKING:
    from distributed import LocalCluster

TIMEOUT_S = 60.0


TRIALS = Trials(World("tunnel_exit"), Estimator(way="ekf"))

TIMES = ("seconds", "window_ms")


class Square(NamedTuple):
    """Squares a number and leaves a trace of having done so."""

    number: float
    folder: str = ""
    kind: str = "square"
    weight: float = 1.0

    @property
    def name(self) -> str:
        return self.kind

    def compute(self) -> Arrays:
        if self.folder:
            with Path(self.folder, f"{self.number:g}").open("a") as trace:
                trace.write("computed\n")
        return {"square": np.array([self.number**2])}


class Killed(NamedTuple):
    """Is killed as the kernel kills what takes too much memory."""

    name: str = "killed"
    weight: float = 1.0

    def compute(self) -> Arrays:
        os.kill(os.getpid(), signal.SIGKILL)
        return {}


class Told(NamedTuple):
    """Says how many threads its linear algebra was told to take."""

    name: str = "told"
    weight: float = 1.0

    def compute(self) -> Arrays:
        return {"threads": np.array([int(os.environ[name]) for name in engines.THREADS])}


@pytest.fixture(scope="module")
def dask() -> Iterator[LocalCluster]:
    """A cluster of two workers, which hear of the tasks through TCP."""
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, protocol="tcp://", dashboard_address=None
    ) as local:
        yield local


def squares(wanted: Sequence[Task], where: Running) -> list[float]:
    return [float(found["square"][0]) for found in run_all(wanted, where)]


def test_a_result_comes_back_from_the_cache_whole(tmp_path: Path) -> None:
    result = {"rows": np.array([(1, 2.5)], dtype=[("a", int), ("b", float)]), "seconds": np.array(0.1)}
    save(Square(1.0), result, tmp_path)
    again = load(Square(1.0), tmp_path)
    assert {name: (values.dtype, values.tolist()) for name, values in again.items()} == {
        name: (values.dtype, values.tolist()) for name, values in result.items()
    }
    assert [file.name for file in tmp_path.iterdir()] == [file_name(Square(1.0))]


def test_a_file_is_that_of_the_fields_and_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = {file_name(task) for task in (TRIALS, Square(1.0), Square(2.0), Square(1.0, kind="other"), Killed())}
    for folder, code in (("one", "a = 1"), ("other", "a = 2")):
        (tmp_path / folder / "sim_node").mkdir(parents=True)
        (tmp_path / folder / "sim_node" / "numbers.py").write_text(code)
        monkeypatch.setattr(running, "PACKAGES", tmp_path / folder)
        names.add(file_name(Square(1.0)))
    assert len(names) == 7


def test_a_killed_study_goes_on_where_it_stopped(tmp_path: Path) -> None:
    cache, traces = tmp_path / "cache", tmp_path / "traces"
    traces.mkdir()
    assert squares([Square(2.0, str(traces))], Running(cache)) == [4.0]
    (cache / "unfinished.npz.1").write_bytes(b"half a re")
    wanted = [Square(number, str(traces)) for number in (3.0, 2.0, 3.0)]
    assert squares(wanted, Running(cache)) == [9.0, 4.0, 9.0]
    assert {file.name: file.read_text() for file in traces.iterdir()} == {"2": "computed\n", "3": "computed\n"}


@pytest.mark.parametrize("left", [b"", b"PK\x03\x04 half a run", bytes(500)])
def test_a_run_that_a_power_cut_has_left_in_part_is_computed_anew(tmp_path: Path, left: bytes) -> None:
    (tmp_path / file_name(Square(2.0))).write_bytes(left)
    assert squares([Square(2.0)], Running(tmp_path)) == [4.0]


def test_without_a_home_the_cache_has_to_be_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a user that the system does not know; to import the module was an error."""
    monkeypatch.setattr(running, "CACHE", Path("~/.cache/adhesion_node"))
    parser = argparse.ArgumentParser()
    running.add_running_options(parser)
    assert running.running(parser.parse_args(["--cache", "here"])).cache == Path("here")
    with pytest.raises(ValueError, match="name one with --cache"):
        running.running(parser.parse_args([]))


def test_a_cluster_takes_the_place_of_the_workers(tmp_path: Path, dask: LocalCluster) -> None:
    wanted = [Square(float(number)) for number in range(20)]
    assert squares(wanted, Running(tmp_path, workers=0, scheduler=dask.scheduler_address)) == [
        number**2 for number in range(20)
    ]


def test_a_cluster_gives_the_numbers_of_the_processes(tmp_path: Path, dask: LocalCluster) -> None:
    pipeline = TRIALS._replace(estimator=Estimator())
    wanted: list[Task] = [TRIALS, pipeline, TRIALS._replace(first_seed=1001)]
    wanted += [Experiment(2, 1), Experiment(2, 1, VARYING_ETA, 50, "swings")]
    ours = list(run_all(wanted, Running(tmp_path / "processes", workers=2)))
    theirs = list(run_all(wanted, Running(tmp_path / "cluster", scheduler=dask.scheduler_address)))
    for one, other in zip(ours, theirs, strict=True):
        assert one.keys() == other.keys()
        assert all(one[name].tobytes() == other[name].tobytes() for name in one if name not in TIMES)
    files = [sorted(file.name for file in folder.iterdir()) for folder in tmp_path.iterdir()]
    assert files == [sorted(map(file_name, wanted))] * 2


def test_a_worker_with_other_code_is_refused(tmp_path: Path, dask: LocalCluster) -> None:
    with (
        pytest.raises(OSError, match=r"install this package.*has another version") as caught,
        engines.cluster(dask.scheduler_address) as executor,
    ):
        executor.submit(running._compute, Square(1.0), "square-of-another-version.npz").result(TIMEOUT_S)
    assert caught.value.filename == dask.scheduler_address


@pytest.mark.parametrize("study", ["tables", "sensitivity", "tune-ekf", "creep"])
def test_a_scheduler_that_does_not_answer_is_one_line_and_code_1(
    study: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    monkeypatch.setattr(engines, "CONNECT_S", 0.2)
    with socket.socket() as unused:  # bound but not listening: nobody answers
        unused.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{unused.getsockname()[1]}"
        assert main([study, "--runs", "2", "--cache", str(tmp_path), "--scheduler", address]) == 1
    assert capsys.readouterr().err == f"study: {address}: no Dask scheduler answered within 0.2 s\n"


def test_what_is_no_address_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tables", "--runs", "1", "--cache", str(tmp_path), "--scheduler", "nonsense"]) == 2
    assert capsys.readouterr().err.startswith("study: scheduler = nonsense: ")


def test_without_dask_the_extra_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["tables", "--runs", "1", "--cache", str(tmp_path), "--scheduler", "tcp://localhost:8786"]) == 2
    assert capsys.readouterr().err.endswith("needs the extra cluster, pip install '.[cluster]'\n")


def test_a_killed_worker_ends_the_study_with_a_reason(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="a worker was killed"):
        squares([Killed()], Running(tmp_path))


def test_workers_do_not_take_each_others_cores(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in engines.THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(engines.THREADS[0], "3")
    (told,) = run_all([Told()], Running(tmp_path))
    assert told["threads"].tolist() == [3, 1, 1]


def test_a_cache_that_cannot_be_made_is_told_with_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match=r"cache = .*: Not a directory: name a place for finished runs with --cache"):
        squares([Square(1.0, "")], Running(tmp_path / "file" / "cache"))


def test_bad_numbers_of_workers_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tune-ekf", "--runs", "1", "--cache", str(tmp_path), "--workers", "0"]) == 2
    assert capsys.readouterr().err == "study: workers = 0: give at least 1\n"


ENDLESS = """
import socket, sys
from pathlib import Path
from typing import NamedTuple
from adhesion_node.command.options import run_tool
from adhesion_node.command.running import Running, run_all
import argparse

class Endless(NamedTuple):
    number: int
    port: int
    name, weight = "endless", 1.0

    def compute(self):
        held = socket.create_connection(("127.0.0.1", self.port))
        while True:
            sum(range(1000))

def work(options):
    return len(list(run_all([Endless(i, int(sys.argv[1])) for i in range(2)], Running(Path(sys.argv[2]), 2))))

if __name__ == "__main__":
    sys.exit(run_tool(argparse.ArgumentParser("endless"), work, []))
"""
"""A study whose tasks never end; each holds a connection as long as its process lives."""


@pytest.fixture
def endless(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], list[socket.socket]]]:
    """The endless study at work, and its tasks' connections."""
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS)
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(TIMEOUT_S)
        arguments = [sys.executable, str(script), str(server.getsockname()[1]), str(tmp_path / "cache")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        study = subprocess.Popen(arguments, env=environment, stderr=subprocess.PIPE, text=True)
        connections = []
        try:
            connections = [server.accept()[0] for _ in range(2)]
            yield study, connections
        finally:
            study.kill()
            study.communicate(timeout=TIMEOUT_S)
            for connection in connections:
                connection.close()


@pytest.mark.parametrize(
    ("sent", "code"), [(signal.SIGKILL, -signal.SIGKILL), (signal.SIGTERM, 143), (signal.SIGINT, 1)]
)
def test_no_worker_outlives_its_study(
    endless: tuple[subprocess.Popen[str], list[socket.socket]], sent: signal.Signals, code: int
) -> None:
    study, connections = endless
    study.send_signal(sent)
    for connection in connections:
        connection.settimeout(TIMEOUT_S)
        assert connection.recv(1) == b""  # closed by the end of the process
    assert study.wait(TIMEOUT_S) == code

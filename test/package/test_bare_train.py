# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train has ROS, numpy, scipy and numba: the nodes run there, and every other program says what it lacks."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from functools import cache
from importlib.metadata import packages_distributions

import pytest
from conftest import ROOT
from forked import Call, Ended, ended
from test_package import console_scripts, names_of, setup_arguments

ON_THE_TRAIN = ("estimator", "creep_estimator", "atp_monitor", "simulator", "slip_simulator")
DEFAULTS = ROOT / "adhesion_node" / "nodes" / "defaults.yaml"

REFUSING = """
import sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {refused}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Refuse())
"""
"""Nothing is installed that setup.py has as an extra."""

NO_PROGRAM = {"ros", "test", "lint", "docs", "build"}
"""Extras that no program imports, and ROS itself."""


@cache
def refused() -> frozenset[str]:
    """The modules that the extras bring."""
    extras = setup_arguments()["extras_require"]
    wanted = names_of(one for name, extra in extras.items() if name not in NO_PROGRAM for one in extra)
    wanted = {name.lower().replace("_", "-") for name in wanted} - names_of(setup_arguments()["install_requires"])
    there = packages_distributions().items()
    return frozenset(name for name, of in there if {one.lower().replace("_", "-") for one in of} <= wanted)


def on_bare(program: str, *arguments: str, without: frozenset[str] | None = None) -> subprocess.Popen[str]:
    private = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
    environment = {name: value for name, value in os.environ.items() if name not in private}
    code = REFUSING.format(refused=set(without or refused()))
    code += f"from adhesion_node import main\nsys.exit(main.{program}())"
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("program", ON_THE_TRAIN)
def test_a_node_runs_with_ros_and_what_is_always_installed(program: str) -> None:
    assert {"matplotlib", "mcap", "rosbags", "pyproj", "argcomplete"} <= refused()
    with on_bare(program, "--ros-args", "--params-file", str(DEFAULTS)) as process:
        try:
            assert process.stderr is not None
            told = next((line for line in process.stderr if "parameters: " in line), "")
            process.send_signal(signal.SIGINT)
            _, rest = process.communicate(timeout=60.0)
        finally:
            process.kill()
    assert told, rest
    assert process.returncode == 0, rest


@pytest.mark.parametrize("program", ["report", "brakings", "estimator"])
def test_the_version_is_told_whatever_is_missing(program: str) -> None:
    with on_bare(program, "--version", without=refused() | {"rclpy"}) as process:
        told, _ = process.communicate(timeout=60.0)
    assert process.returncode == 0
    assert ", adhesion_node " in told


OTHERS = sorted(console_scripts().keys() - set(ON_THE_TRAIN))


@pytest.fixture(scope="module")
def others(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Ended]:
    """How every other program ends there."""
    first = f"{REFUSING.format(refused=set(refused()))}import adhesion_node.nodes.estimator, sim_node.nodes.simulator"
    calls: list[Call] = [
        ([program, *(["--output", "run"] if program == "recorder" else ["--help"])], {}) for program in OTHERS
    ]
    return dict(zip(OTHERS, ended(calls, tmp_path_factory.mktemp("bare") / "calls", first), strict=True))


@pytest.mark.parametrize("program", OTHERS)
def test_any_other_program_says_what_to_install(program: str, others: dict[str, Ended]) -> None:
    told = others[program]
    if program in ("bench", "study"):  # they load what they run when it is asked for
        assert (told.returncode, told.stderr) == (0, "")
    else:
        assert told.returncode == 2
        assert re.fullmatch(rf"{program}: (rosbags|pandas) is missing: pip install '\.\[tools\]'\n", told.stderr)


def test_without_the_compiler_it_says_so() -> None:
    with on_bare("estimator", "--help", without=frozenset({"numba"})) as process:
        _, told = process.communicate(timeout=60.0)
    assert (process.returncode, told) == (2, "estimator: numba is missing: pip install .\n")


def test_the_estimator_drags_nothing_else_in() -> None:
    """An optional package that is there is not loaded either: the start is as quick as ROS itself allows."""
    everywhere = loaded_with("site")  # by a .pth file: older matplotlib has one
    assert not (loaded_with("adhesion_node.nodes.estimator") - everywhere) & {*refused(), "pandas", "matplotlib"}


def test_what_needs_no_estimator_starts_without_its_libraries() -> None:
    nodes = {f"adhesion_node.nodes.{name}" for name in ("atp_monitor", "recorder", "player")}
    assert not loaded_with(*nodes, "adhesion_node.live.__main__") & {"scipy", "numba", "pandas", "matplotlib"}


def loaded_with(*modules: str) -> set[str]:
    """Names of all that is imported with some modules."""
    code = f"import sys, {', '.join(modules)}; print(*{{name.partition('.')[0] for name in sys.modules}})"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())

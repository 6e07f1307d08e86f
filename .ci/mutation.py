# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Mutation testing: a sample of small changes to the last commit's core, and those that no test notices.

Usage: mutation.py [--part PART] [--mutants N] [--seed N] [--workers N] [--kept FOLDER], with the extra `mutation`.
Cosmic Ray makes the mutants, in clones. Each is shown to the tests that reach its line, the quickest first, until one
fails, and last to the check of the pages, whose tables state the bank's constants; what that alone notices is counted
apart. Settings' declarations are left out: tests hold them equal to defaults.yaml and to doc/parameters.md.
"""

import argparse
import json
import math
import multiprocessing
import os
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Collection
from difflib import unified_diff
from pathlib import Path

import coverage
import hypothesis
import numba
import pytest
from cosmic_ray.commands.init import _all_work_items
from cosmic_ray.mutating import use_mutation
from cosmic_ray.plugins import get_operator
from cosmic_ray.work_item import MutationSpec
from scipy import special

ROOT = Path(__file__).resolve().parent.parent
CORE = Path("adhesion_node/core")
PARTS = ("atp", "bank", "belief", "creep", "estimator", "intake", "methods", "physics")
"""Folders of the core; the estimator is the modules beside them."""

MEANINGLESS = re.compile(r".*(Bit|Shift|_Mod|FloorDiv|RemoveDecorator|ExceptionReplacer|_Is|_IsNot|ZeroIteration).*")
"""Operators whose mutants fail at once, or change an annotation alone."""

TESTS = {
    False: [
        *("--doctest-modules", "adhesion_node/core", "test/core"),
        *("--ignore-glob=*/test_trains.py", "--ignore-glob=*/test_faults_simulated.py"),  # of the simulator, and slow
        *("test/run/test_pipeline.py", "test/run/test_digest.py", "test/run/test_frames.py"),
        *("test/run/results/test_seen.py", "test/run/results/test_results.py", "test/run/results/test_score.py"),
    ],
    True: [
        *("test/core/bank", "test/core/methods", "-k"),
        "not (compiled or wanders or whole_bank or ten_minutes or weak_brake or never_lowers or converge"
        " or monte_carlo or exact_statistics or resamplings or brute_force)",
        *("--ignore-glob=*/test_detection.py", "--ignore-glob=*/test_condition.py"),
        *("--ignore-glob=*/test_changes.py", "--ignore-glob=*/test_noise.py"),
    ],
}
"""Who must notice, by whether it is a kernel's mutant: those run uncompiled, as nothing else tells what is reached."""

BUDGET_S = 10.0
"""Seconds of the processor for the tests of one mutant, by what they take without it; one that takes more is none."""

LIMIT_S = 6.0 * BUDGET_S
"""A mutant that takes longer never ends."""

LOADED = (numba, special)
"""Loaded once: each mutant's tests run in a fork."""


ALIVE, BY_PAGES = 0, -1
"""What became of a mutant that no test noticed, and of one that the check of the pages alone did; others are killed."""


class Recorder:
    """Plugin of pytest: which lines each passed test reaches, and the seconds of the processor that it takes."""

    def __init__(self, data: Path) -> None:
        self.coverage = coverage.Coverage(str(data), source=[str(CORE)], config_file=False)
        self.coverage.set_option("run:relative_files", True)
        self.taken_s: dict[str, float] = {}
        self.began = 0.0

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Begin a test."""
        self.coverage.switch_context(nodeid)
        self.began = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, BUDGET_S)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """End a part of a test: set-up, call or tear-down."""
        signal.setitimer(signal.ITIMER_PROF, 0.0 if report.when == "teardown" else BUDGET_S)
        if not report.passed:  # it wants a node's fixtures, say, or took too long
            self.taken_s[report.nodeid] = math.inf
        elif report.when == "teardown":
            self.taken_s.setdefault(report.nodeid, time.process_time() - self.began)


def main() -> int:
    """Return 0 where nine of ten mutants are killed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--part", action="append", choices=PARTS, help="what is mutated (default: all)")
    parser.add_argument("--mutants", type=int, default=300, help="how many in all (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the sample (default %(default)s)")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="side by side (default %(default)s)")
    parser.add_argument("--kept", type=Path, help="folder of clones and of what tests reach: for more runs of a commit")
    options = parser.parse_args()
    became = defaultdict[str, list[int]](list)
    fork = multiprocessing.get_context("fork")
    with tempfile.TemporaryDirectory() as folder:
        kept = (options.kept or Path(folder)).resolve()
        clones = fork.SimpleQueue()
        for number in range(options.workers):
            clones.put(cloned(kept / str(number)))
        os.chdir(kept / "0")
        if not pages_agree():
            raise RuntimeError("the pages of the last commit do not say what its code does: run python doc/generate.py")
        chosen = sample(options.part or PARTS, options.mutants, random.Random(options.seed))
        with fork.Pool(options.workers, lambda: os.chdir(clones.get())) as pool:
            missing = [(kept, uncompiled) for uncompiled in TESTS if not (kept / f"{uncompiled}.json").exists()]
            pool.starmap(record, missing, chunksize=1)
            for mutation, difference, status in pool.imap_unordered(tried, [(kept, mutation) for mutation in chosen]):
                became[part_of(mutation)].append(status)
                became["all"].append(status)
                print(f"\r{len(became['all'])} of {len(chosen)} tried", end="", file=sys.stderr, flush=True)
                if status == ALIVE:
                    print(difference, flush=True)
    for part, each in became.items():
        killed, by_pages = len(each) - each.count(ALIVE), each.count(BY_PAGES)
        print(f"{part}: {killed} of {len(each)} killed, {killed / len(each):.1%}; {by_pages} by the pages alone")
    return 0 if became["all"].count(ALIVE) <= 0.1 * len(chosen) else 1


def cloned(folder: Path) -> Path:
    """Return a clone of the last commit, its modules compiled: a mutant's file is newer than that."""
    if folder.exists():
        return folder
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(folder)], check=True)
    subprocess.run([sys.executable, "-m", "compileall", "-q", CORE.parent, "test"], cwd=folder, check=True)
    return folder


def part_of(mutation: MutationSpec) -> str:
    """Return the part that a mutant is in."""
    below = mutation.module_path.relative_to(CORE).parts
    return below[0] if len(below) > 1 else "estimator"


def sample(parts: Collection[str], count: int, rng: random.Random) -> list[MutationSpec]:
    """Return mutants of some parts, drawn from all of them alike."""
    modules = [path for path in sorted(CORE.rglob("*.py")) if path.name != "config.py"]
    every = [item.mutations[0] for item in _all_work_items(modules, {})]
    useful = [one for one in every if part_of(one) in parts and not MEANINGLESS.match(one.operator_name)]
    return rng.sample(useful, min(count, len(useful)))


def record(kept: Path, uncompiled: bool) -> None:
    """Write which line of the core each test reaches, and what it takes."""
    recorder = Recorder(kept / f"{uncompiled}.coverage")

    def too_long(*_: object) -> None:
        raise TimeoutError

    def run() -> int:
        signal.signal(signal.SIGPROF, too_long)
        recorder.coverage.start()
        status = tests_run(TESTS[uncompiled], uncompiled, recorder)
        recorder.coverage.stop()
        recorder.coverage.save()
        if status in (pytest.ExitCode.USAGE_ERROR, pytest.ExitCode.INTERRUPTED):
            return 1
        kept.joinpath(f"{uncompiled}.json").write_text(json.dumps(recorder.taken_s), encoding="utf-8")
        return 0

    if forked(run, None):
        raise RuntimeError(f"the tests {' '.join(TESTS[uncompiled])} cannot be collected: run them by pytest")


def tried(task: tuple[Path, MutationSpec]) -> tuple[MutationSpec, str, int]:
    """Return a mutant, its difference, and what became of it."""
    kept, mutation = task
    uncompiled = "kernels" in mutation.module_path.parts
    tests = tests_of(kept, mutation, uncompiled)
    with use_mutation(mutation.module_path, get_operator(mutation.operator_name)(), mutation.occurrence) as codes:
        before, after = (code.splitlines() for code in codes)
        difference = "\n".join(unified_diff(before, after, str(mutation.module_path), n=1, lineterm=""))
        status = forked(lambda: tests_run(["-x", "--doctest-modules", *tests], uncompiled), LIMIT_S) if tests else ALIVE
        if status == ALIVE and not pages_agree():
            status = BY_PAGES
    return mutation, difference, status


def pages_agree() -> bool:
    """Whether the pages of the clone say what its code does."""
    own = os.environ | {"PYTHONPATH": os.getcwd()}
    check = [sys.executable, "-B", "doc/generate.py", "--check"]
    return subprocess.run(check, env=own, capture_output=True, check=False).returncode == 0


def tests_of(kept: Path, mutation: MutationSpec, uncompiled: bool) -> list[str]:
    """Return the tests that reach a mutant's line; of one that is run as it is imported those that reach its file."""
    data = coverage.CoverageData(str(kept / f"{uncompiled}.coverage"))
    data.read()
    by_line = data.contexts_by_lineno(str(mutation.module_path))
    lines = range(mutation.start_pos[0], mutation.end_pos[0] + 1)
    taken_s = json.loads(kept.joinpath(f"{uncompiled}.json").read_text(encoding="utf-8"))
    able = {test for line in lines for test in by_line.get(line, [""])}
    if "" in able:
        able = {test for tests in by_line.values() for test in tests}
    chosen, budget_s = [], BUDGET_S
    for test in sorted(able & taken_s.keys(), key=lambda test: (taken_s[test], test)):
        if budget_s > 0.0 and taken_s[test] < math.inf:
            chosen.append(test)
            budget_s -= taken_s[test]
    return chosen


def tests_run(arguments: list[str], uncompiled: bool, *plugins: object) -> int:
    """Run tests in this process, without the set-up that all share: none of them needs ROS. Return pytest's status."""
    os.environ |= {"OPENBLAS_NUM_THREADS": "1", "NUMBA_DISABLE_JIT": str(int(uncompiled))}
    numba.config.reload_config()
    sys.dont_write_bytecode = not plugins
    sys.path[:0] = [os.getcwd(), os.path.join(os.getcwd(), "test")]
    quick = [hypothesis.Phase.explicit, hypothesis.Phase.generate]
    hypothesis.settings.register_profile("quick", derandomize=True, deadline=None, max_examples=60, phases=quick)
    hypothesis.settings.load_profile("quick")
    options = ["-q", "--noconftest", "-p", "no:cacheprovider", "-o", "addopts="]
    return int(pytest.main([*options, *arguments], plugins))


def forked(run: Callable[[], int], limit_s: float | None) -> int:
    """Return the status of what runs in a process of its own, silently, not 0 where that is ended by the limit."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.dup2(1, 2)
            if limit_s is not None:
                resource.setrlimit(resource.RLIMIT_CPU, (int(limit_s), int(limit_s)))
            status = run()
        finally:
            os._exit(status)
    return os.waitpid(child, 0)[1]


if __name__ == "__main__":
    sys.exit(main())

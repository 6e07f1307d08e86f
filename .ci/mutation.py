# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Mutation testing: a sample of small changes to the last commit's core, and those that no test notices.

Usage: mutation.py [--part PART] [--mutants N] [--seed N], with the extra `mutation`. Cosmic Ray makes the mutants, in a
clone; settings' declarations are left out, as tests hold them equal to defaults.yaml and to doc/parameters.md.
"""

import argparse
import os
import random
import re
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import WorkerOutcome, WorkResult

ROOT = Path(__file__).resolve().parent.parent
PARTS = {
    "atp": ("core/atp", "test/core/atp"),
    "physics": ("core/physics", "test/core/physics --ignore=test/core/physics/test_trains.py"),
    "intake": ("core/intake", "test/core/intake"),
    "prediction": ("core/prediction.py", "test/core/test_prediction.py"),
}
"""Module or package under adhesion_node, and the tests that must notice."""

MEANINGLESS = re.compile(r".*(Bit|Shift|_Mod|FloorDiv|RemoveDecorator|ExceptionReplacer|_Is|_IsNot|ZeroIteration).*")
"""Operators whose mutants fail at once, or change an annotation alone."""

PYTEST = f"{sys.executable} -m pytest -q -x -p no:cacheprovider --noconftest --hypothesis-profile=ci -o addopts="
"""Without the set-up that all tests share, which compiles kernels: these need neither ROS nor the bank."""


def main() -> int:
    """Return 0 where nine of ten mutants are killed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--part", action="append", choices=PARTS, help="what is mutated (default: all)")
    parser.add_argument("--mutants", type=int, default=50, help="of each part (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the sample (default %(default)s)")
    options = parser.parse_args()
    killed = total = 0
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["git", "clone", "--quiet", str(ROOT), folder], check=True)
        for part in options.part or PARTS:
            survivors, of = mutated(Path(folder), part, options.mutants, random.Random(options.seed))
            killed, total = killed + of - len(survivors), total + of
            print(*survivors, f"{part}: {of - len(survivors)} of {of} killed", sep="\n", flush=True)
    print(f"{killed / total:.0%} of {total} mutants killed")
    return 0 if killed >= 0.9 * total else 1


def mutated(clone: Path, part: str, count: int, rng: random.Random) -> tuple[list[str], int]:
    """Try mutants of a part; return the differences that survived, and how many were tried."""
    module, tests = PARTS[part]
    session, config = clone / f"{part}.sqlite", clone / f"{part}.toml"
    command = f"{PYTEST} --doctest-modules adhesion_node/{module} {tests}"
    began = time.monotonic()
    environment = os.environ | {"PYTHONPATH": f"{clone}:{clone / 'test'}", "PYTHONDONTWRITEBYTECODE": "1"}
    subprocess.run(shlex.split(command), cwd=clone, env=environment, check=True, stdout=sys.stderr)
    limit_s = 60.0 + 5.0 * (time.monotonic() - began)
    config.write_text(
        f'[cosmic-ray]\nmodule-path = "adhesion_node/{module}"\ntimeout = {limit_s:.0f}\n'
        f'excluded-modules = ["**/config.py"]\ntest-command = "{command}"\n[cosmic-ray.distributor]\nname = "local"\n',
        encoding="utf-8",
    )
    cosmic_ray = [str(Path(sys.executable).with_name("cosmic-ray"))]
    subprocess.run([*cosmic_ray, "init", config.name, session.name], cwd=clone, check=True)
    with use_db(str(session), WorkDB.Mode.open) as db:
        every = sorted(db.work_items, key=lambda item: str(item.mutations))
        useful = [item for item in every if not MEANINGLESS.match(item.mutations[0].operator_name)]
        chosen = {item.job_id for item in rng.sample(useful, min(count, len(useful)))}
        left_out = WorkResult(worker_outcome=WorkerOutcome.SKIPPED)
        db.set_multiple_results([item.job_id for item in every if item.job_id not in chosen], left_out)
    subprocess.run([*cosmic_ray, "exec", config.name, session.name], cwd=clone, env=environment, check=True)
    with use_db(str(session), WorkDB.Mode.open) as db:
        tried = [result for job, result in db.results if job in chosen]
    return [str(result.diff) for result in tried if not result.is_killed], len(tried)


if __name__ == "__main__":
    sys.exit(main())

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Kill, stop, flood and mislead the real processes of a line, and see whether the monitor says so and all recover.

    python test/chaos.py            # ten minutes, seed 1
    python test/chaos.py 1 7        # one minute, seed 7

Simulator, estimator, ATP monitor and recorder run as processes; this one kills them (-9), stops and continues them,
floods and flaps their topics and sets /clock, by a script that the seed makes. It ends with a table: *told*, time from
what makes the train's state unsafe to know until `atp/status` says EMERGENCY_BRAKE; *recovered*, time from its end
until the train is let go; *pause*, longest time between two `atp/status` of a monitor that lives. Then what recordings
lack of what was heard, and the growth of memory. Exit code 1 when something was silent, lost or unbounded.
"""

from __future__ import annotations

import os
import random
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from disturbed.deeds import DEEDS, Done, perform, script
from disturbed.kept import kept
from disturbed.line import Line

from adhesion_node.wire import topics

STARTED_S = 300.0
"""Until the first supervised train: an estimator that has never run compiles its loops."""

GROWTH_MB = 40.0
"""Memory may grow by so much."""

LONGEST_RUN_S = 150.0
"""Of a simulator: its scenario ends some time later."""


def run(line: Line, minutes: float) -> list[Done]:
    """Go through the script for so long."""
    if not line.spin(STARTED_S, lambda: line.heard(0.0, False) is not None):
        return [Done("start", None, STARTED_S, None, "no supervised train")]
    done: list[Done] = []
    end_s = time.monotonic() + 60.0 * minutes
    for due in script(line.rng):
        if time.monotonic() > end_s:
            return done
        old = time.monotonic() - line.simulator.since_s > LONGEST_RUN_S
        done.append(perform(line, "kill -9 simulator, clock on by 1000 s" if old else due))
        print(f"{done[-1]}", file=sys.stderr)
        for process in line.processes:
            process.measure()
    return done


def table(done: list[Done]) -> Iterator[str]:
    """A line for each kind of deed: how often, and the longest times."""
    yield f"{'':<42}{'times':>6}{'told s':>8}{'recovered s':>13}{'pause s':>9}"
    for name in DEEDS:
        rows = [one for one in done if one.name == name]
        if rows:
            told, pauses = [one.told_s for one in rows], [one.pause_s for one in rows]
            cells = [
                f"{max(times):.1f}" if (times := [s for s in all_s if s is not None]) else "-"
                for all_s in (told, pauses)
            ]
            longest = max(one.recovered_s for one in rows)
            yield f"{name:<42}{len(rows):>6}{cells[0]:>8}{longest:>13.1f}{cells[1]:>9}"


def main(arguments: list[str]) -> int:
    """Run the script, print the table and what was wrong."""
    minutes = float(arguments[0]) if arguments else 10.0
    seed = int(arguments[1]) if len(arguments) > 1 else 1
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    os.environ.setdefault("ROS_DOMAIN_ID", "102")
    with tempfile.TemporaryDirectory() as name:
        os.environ.setdefault("ROS_LOG_DIR", name)
        line = Line(Path(name), random.Random(seed))
        try:
            done = run(line, minutes)
            faults = [f"{one.name}: {one.fault}" for one in done if one.fault]
            faults += filter(None, (process.end() for process in line.processes))
        finally:
            for process in line.processes:
                process.kill()
        faults += [f"{process.name}: a traceback" for process in line.processes if process.traceback]
        lives = {topics.STATE.name: line.estimator.begun_s, topics.ATP_STATUS.name: line.monitor.begun_s}
        held = list(kept(line.sent, lives, line.recorded))
        grown = {process.name: process.grown_mb for process in line.processes}
    faults += [fault for one in held for fault in one.faults]
    asked, missing = sum(one.asked for one in held), sum(len(one.lost_s) for one in held)
    faults += [] if asked else ["nothing was recorded"]
    faults += [f"{name} grew by {mb:.0f} MB" for name, mb in grown.items() if mb > GROWTH_MB]
    print(f"seed {seed}, {minutes:g} minutes, {len(done)} deeds")
    print("\n".join(table(done)))
    found_s = max((one.found_s for one in held), default=0.0)
    unsaved_s = max((one.unsaved_s for one in held), default=0.0)
    print(f"lost: {missing} of {asked} messages in {len(line.recorded)} recordings")
    print(f"until a recorder found a publisher: {found_s:.1f} s; not saved before it was killed: {unsaved_s:.1f} s")
    print("grown by, MB: " + ", ".join(f"{name} {mb:.1f}" for name, mb in grown.items()))
    print("\n".join(faults) or "nothing silent, lost or unbounded")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

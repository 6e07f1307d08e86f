# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`demo`: simulator, estimator, ATP monitor and recorder in one process, then the result.

Leaves a recording and a picture and prints what was identified. It runs as fast as it can, or with --live at real time
and with a page in the browser.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from functools import partial
from itertools import chain, count
from pathlib import Path
from shutil import rmtree

from rclpy.executors import SingleThreadedExecutor

from sim_node.real.plant.scenarios import SCENARIOS as REAL
from sim_node.real.sensors.fitted import FITTED
from sim_node.settings import SENSORS
from sim_node.train.scenario import SCENARIOS

from ...bag import BagReader
from ...command.checks import at_least, refuse
from ...command.options import DONE, FAILED, help_texts, json_option, report, run_tool
from ...command.signals import stop_on_signals
from ...core import Estimate
from ...core.physics.train import KMH
from ...live.__main__ import address_of, address_options
from ...live.node import Live
from ...report.drawn.picture import draw
from ...report.drawn.table import table
from ...report.found.regimes import IN_WORDS
from ...report.read.recorded import read_run
from ...wire.settings.setup import setup_of
from .evaluated import evaluate, found, said, true_bands
from .line import UNASKED, Pace, executor_of_line, parameters, play
from .staged import PARAMS, task_of

EXAMPLES = (
    "demo",
    "demo --live",
    "demo --scenario low_adhesion_patch --seed 3 --output my_demo",
    "demo --scenario leaves --sensors full",
    "demo --json - > result.json",
)

SHOWN_EVERY_S = 5.0
"""Simulated time between two lines of progress."""

POLL_S = 0.05
"""Longest time until a signal is seen."""


class _Progress:
    """Prints a line about every `SHOWN_EVERY_S` of simulated time on standard error."""

    def __init__(self) -> None:
        self._due_ns = 0
        self.started_s = 0.0
        """By the monotonic clock: before the first sample."""

    def show(self, at_s: float, estimate: Estimate | None) -> bool:
        """Print the estimate if a line is due; True: the run goes on."""
        if not at_s:
            self.started_s = time.monotonic()
            _say(f"{'time':>7} {'speed':>10} {'mu':>7} {'at least':>9}  what limits")
        if estimate is not None and estimate.t_ns >= self._due_ns:
            self._due_ns = estimate.t_ns + round(SHOWN_EVERY_S * 1e9)
            _say(
                f"{estimate.t_ns * 1e-9:5.0f} s {abs(estimate.speed_mps) / KMH:5.0f} km/h {estimate.mu:7.4f} "
                f"{estimate.mu_lower:9.4f}  {IN_WORDS[estimate.regime.name]}"
            )
        return True


def main(args: Sequence[str] | None = None) -> int:
    """Run the demo."""
    parents = [json_option(), address_options()]
    parser = argparse.ArgumentParser("demo", parents=parents, **help_texts(__doc__, *EXAMPLES))
    parser.add_argument("--live", action="store_true", help="at real time, with a page in the browser")
    parser.add_argument("--scenario", default="tunnel_entry", choices=(*SCENARIOS, *REAL), help="what happens")
    fitted = f"of a real train, which has the scenarios from {next(iter(REAL))} on (default: {SENSORS.default})"
    parser.add_argument("--sensors", choices=tuple(FITTED), help=fitted)
    parser.add_argument("--seed", type=int, default=1, help="seed of the noise")
    folder = "default: adhesion_demo, numbered"
    parser.add_argument("--output", type=Path, default=Path("adhesion_demo"), metavar="DIR", help=folder)
    return run_tool(parser, _demo, args)


def _demo(options: argparse.Namespace) -> int:
    """Run it; ValueError where an option would mean nothing."""
    at_least(options, seed=0)
    if not options.live:
        refuse(options, ["host", "port"], "there is no page without --live: add that, or leave this out")
    if options.scenario not in REAL:
        real = f"a scenario of a real train: {', '.join(REAL)}"
        refuse(options, ["sensors"], f"{options.scenario} has its own: leave them out, or choose {real}")
    options.sensors = options.sensors or SENSORS.default
    progress = _Progress()
    with executor_of_line() as executor:
        return _live(options, executor, progress) if options.live else _run(options, executor, progress.show)


def _live(options: argparse.Namespace, executor: SingleThreadedExecutor, progress: _Progress) -> int:
    """Run at real time with a page in the browser, until Ctrl-C."""
    page_of = partial(Live, parameter_overrides=parameters(**UNASKED), context=executor.context)
    with stop_on_signals() as stop, closing(page_of(*address_of(options))) as page:
        executor.add_node(page)

        def wait(done: Callable[[], bool]) -> bool:
            """Spin until `done()`; False when a signal has come."""
            while not (stop.requested or done()):
                executor.spin_once(timeout_sec=POLL_S)
            return not stop.requested

        def pace(at_s: float, estimate: Estimate | None) -> bool:
            progress.show(at_s, estimate)
            due_s = progress.started_s + at_s
            return wait(lambda: time.monotonic() >= due_s)

        if page.warning:
            _say(f"demo: {page.warning}")
        _say(f"open {page.server.url}: the train starts when the page is open; Ctrl-C ends")
        if not wait(lambda: page.server.viewers > 0):
            return DONE
        code = _run(options, executor, pace, lambda: page.view.end(time.monotonic()))
        while not stop.requested:  # without spinning: the nodes would complain that the clock stands still
            time.sleep(POLL_S)
        return code


def _run(
    options: argparse.Namespace, executor: SingleThreadedExecutor, pace: Pace, ended: Callable[[], None] = lambda: None
) -> int:
    """Play the scenario, call `ended`, evaluate the recording and report; the exit code."""
    started_s = time.monotonic()
    with _folder(options.output) as output:
        task = task_of(options.scenario, options.sensors, options.seed, output)
        target_kmh, train = task.monitor["target_speed_kmh"], setup_of(task.estimator).config.train
        played = play(executor, task, output / "bag", pace)
    ended()
    with BagReader(output / "bag") as reader:
        result, run = evaluate(reader, task), read_run(reader)
    truth = true_bands(played.regimes, run)
    fitted = f", {options.sensors}" if options.scenario in REAL else ""
    draw(run, [output / "run.png"], f"{options.scenario}{fitted}, seed {options.seed}", target_kmh, train, truth)
    if options.scenario in REAL:
        result |= found(truth, run)
    result |= {"live_digest": played.digest, "live_equals_offline": played.digest == result["digest"]}
    result |= {name: str(output / file) for name, file in (("bag", "bag"), ("params", PARAMS), ("picture", "run.png"))}
    result["seconds"] = round(time.monotonic() - started_s, 1)
    report(options.json, result, "\n".join(["", table(run, target_kmh, train), "", *said(result)]))
    return DONE if result["live_equals_offline"] else FAILED


@contextmanager
def _folder(wanted: Path) -> Iterator[Path]:
    """Take the wanted folder, or with the first number behind it that is not taken, before another demo can.

    A run that cannot begin leaves nothing behind.
    """
    numbered = (wanted.with_name(f"{wanted.name}_{number}") for number in count(2))
    folder = next(path for path in chain([wanted], numbered) if _taken(path))
    try:
        yield folder
    except ValueError:
        rmtree(folder)
        raise


def _taken(path: Path) -> bool:
    """Whether the folder was not there and is this program's now."""
    with suppress(FileExistsError):
        path.mkdir(parents=True)
        return True
    return False


def _say(text: str) -> None:
    print(text, file=sys.stderr)


if __name__ == "__main__":
    raise SystemExit(main())

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`demo`: simulator, estimator, ATP monitor and recorder in one process, then the result.

Leaves a recording and a picture and prints what was identified. It runs as fast as it can, or with --live at real time
and with a page in the browser.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from itertools import count, pairwise
from pathlib import Path
from typing import Any

from rclpy.executors import SingleThreadedExecutor

from sim_node.train.scenario import SCENARIOS

from ..bag import BagReader, select
from ..command.options import DONE, FAILED, help_texts, json_option, report, run_tool
from ..command.signals import stop_on_signals
from ..core import Config, Estimate
from ..core.physics.train import KMH
from ..live.__main__ import address_options
from ..live.node import Live
from ..report.picture import draw
from ..report.run import read_run
from ..report.series import read_status
from ..report.table import table
from ..run import offline
from ..run.pipeline import Pipeline
from ..run.score import Truth
from ..wire.topics import ATP_STATUS
from .line import Pace, executor_of_line, play

EXAMPLES = (
    "demo",
    "demo --live",
    "demo --scenario low_adhesion_patch --seed 3 --output my_demo",
    "demo --json - > result.json",
)

SHOWN_EVERY_S = 5.0
"""Simulated time between two lines of progress."""


SAMPLE_S = 0.1
"""Time between two samples of the simulator."""

POLL_S = 0.05
"""Longest time until a signal is seen."""


class _Progress:
    """Prints a line about every `SHOWN_EVERY_S` of simulated time on standard error."""

    def __init__(self) -> None:
        self._due_ns = 0
        self.started_s = 0.0
        """By the monotonic clock: before the first sample."""

    def show(self, samples: int, estimate: Estimate | None) -> bool:
        """Print the estimate if a line is due; True: the run goes on."""
        if not samples:
            self.started_s = time.monotonic()
            _say(f"{'time':>7} {'speed':>10} {'mu':>7} {'at least':>9}  regime")
        if estimate is not None and estimate.t_ns >= self._due_ns:
            self._due_ns = estimate.t_ns + round(SHOWN_EVERY_S * 1e9)
            _say(
                f"{estimate.t_ns * 1e-9:5.0f} s {estimate.speed_mps / KMH:5.0f} km/h {estimate.mu:7.4f} "
                f"{estimate.mu_lower:9.4f}  {estimate.regime.name}"
            )
        return True


def main(args: Sequence[str] | None = None) -> int:
    """Run the demo."""
    parents = [json_option(), address_options()]
    parser = argparse.ArgumentParser("demo", parents=parents, **help_texts(__doc__, *EXAMPLES))
    parser.add_argument("--live", action="store_true", help="at real time, with a page in the browser")
    parser.add_argument("--scenario", default="tunnel_entry", choices=tuple(SCENARIOS), help="what happens")
    parser.add_argument("--seed", type=int, default=1, help="seed of the noise (default: 1)")
    folder = "default: adhesion_demo, numbered"
    parser.add_argument("--output", type=Path, default=Path("adhesion_demo"), metavar="DIR", help=folder)
    return run_tool(parser, _demo, args)


def _demo(options: argparse.Namespace) -> int:
    progress = _Progress()
    with executor_of_line() as executor:
        return _live(options, executor, progress) if options.live else _run(options, executor, progress.show)


def _live(options: argparse.Namespace, executor: SingleThreadedExecutor, progress: _Progress) -> int:
    """Run at real time with a page in the browser, until Ctrl-C."""
    with stop_on_signals() as stop, closing(Live(options.host, options.port, context=executor.context)) as page:
        executor.add_node(page)

        def wait(done: Callable[[], bool]) -> bool:
            """Spin until `done()`; False when a signal has come."""
            while not (stop.requested or done()):
                executor.spin_once(timeout_sec=POLL_S)
            return not stop.requested

        def pace(samples: int, estimate: Estimate | None) -> bool:
            progress.show(samples, estimate)
            due_s = progress.started_s + SAMPLE_S * samples
            return wait(lambda: time.monotonic() >= due_s)

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
    output, started_s = _free(options.output), time.monotonic()
    target_kmh = (SCENARIOS[options.scenario].end_speed_mps or 0.0) / KMH
    digest = play(executor, options.scenario, target_kmh, output / "bag", options.seed, pace)
    ended()
    with BagReader(output / "bag") as reader:
        result, run = _evaluate(reader, options.seed), read_run(reader)
    draw(run, output / "run.png", f"{options.scenario}, seed {options.seed}", target_kmh)
    result |= {"live_digest": digest, "live_equals_offline": digest == result["digest"]}
    result |= {"bag": str(output / "bag"), "picture": str(output / "run.png")}
    result["seconds"] = round(time.monotonic() - started_s, 1)
    report(options.json, result, "\n".join(["", table(run, target_kmh), "", *_said(result)]))
    return DONE if result["live_equals_offline"] else FAILED


def _said(result: dict[str, Any]) -> Iterator[str]:
    """The result in words."""
    if "mean_relative_error_percent" in result:
        yield f"mean relative error while adhesion limits: {result['mean_relative_error_percent']:.2f} %"
    if "ms_per_window_p50" in result:
        yield f"a full window takes {result['ms_per_window_p50']:.0f} ms (median of {result['windows']} windows)"
    same = "gives the same numbers to the last bit" if result["live_equals_offline"] else "GIVES OTHER NUMBERS"
    yield f"an offline replay of the recording {same} (digest {result['digest'][:16]}...)"
    yield f"ATP monitor: {result['atp']}"
    yield f"recording: {result['bag']}    picture: {result['picture']}    ({result['seconds']} s)"


def _free(wanted: Path) -> Path:
    """The wanted folder, or with the first number behind it that is not taken."""
    numbered = (wanted.with_name(f"{wanted.name}_{number}") for number in count(2))
    return wanted if not wanted.exists() else next(path for path in numbered if not path.exists())


def _say(text: str) -> None:
    print(text, file=sys.stderr)


def _evaluate(reader: BagReader, seed: int) -> dict[str, Any]:
    """Replay the demo's own recording offline, and sum up what the ATP monitor said."""
    selection = select(reader.topics)
    pipeline, truth = Pipeline(Config(), seed), Truth()
    replayed = offline.replay(pipeline, truth, offline.messages(reader, selection))
    levels = read_status(reader, ATP_STATUS, "level").values.tolist()
    changes = [level for previous, level in pairwise(["", *levels]) if level != previous]
    return {**offline.summary(pipeline, replayed, truth), "atp": " > ".join(changes)}

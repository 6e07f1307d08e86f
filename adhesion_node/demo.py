"""`demo`: simulator, estimator, ATP monitor and recorder in one process, faster than real time, then the result.

Leaves a recording and a picture and prints what was identified. The simulated clock waits for the estimator, so the
run does not depend on the machine's speed.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import count, pairwise
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from sim_node.node import Simulator
from sim_node.scenario import SCENARIOS

from . import offline
from .bag import BagReader, select
from .cli import DONE, FAILED, help_texts, json_option, report, run_tool
from .core import Config, Estimate
from .core.train import KMH
from .nodes.atp_monitor import AtpMonitor
from .nodes.estimator import Estimator
from .nodes.recorder import Recorder
from .pipeline import Pipeline
from .report.picture import draw
from .report.run import read_run
from .report.series import read_status
from .report.table import table
from .score import Truth
from .topics import ATP_STATUS, POSITION

EXAMPLES = ("demo", "demo --scenario low_adhesion_patch --seed 3 --output my_demo", "demo --json - > result.json")

PATIENCE_S = 10.0
"""Longest wait for a message between two nodes of the process."""

NODES = ("recorder", "estimator", "atp_monitor", "simulator")
"""Their errors are shown, the rest of their log is not: the demo says itself how far it is."""

SHOWN_EVERY_S = 5.0
"""Simulated time between two lines of progress."""


def main(args: Sequence[str] | None = None) -> int:
    """Run the demo."""
    parser = argparse.ArgumentParser("demo", parents=[json_option()], **help_texts(__doc__, *EXAMPLES))
    parser.add_argument("--scenario", default="tunnel_entry", choices=tuple(SCENARIOS), help="what happens")
    parser.add_argument("--seed", type=int, default=1, help="seed of the noise (default: 1)")
    parser.add_argument(
        "--output", type=Path, default=Path("adhesion_demo"), metavar="DIR", help="default: adhesion_demo, numbered"
    )
    return run_tool(parser, _demo, args)


def _demo(options: argparse.Namespace) -> int:
    output = _free(options.output)
    started = time.monotonic()
    digest = _play(options.scenario, output / "bag", options.seed)
    with BagReader(output / "bag") as reader:
        result, run = _evaluate(reader, options.seed), read_run(reader)
    target_kmh = _target_kmh(options.scenario)
    draw(run, output / "run.png", f"{options.scenario}, seed {options.seed}", target_kmh)
    result |= {"live_digest": digest, "live_equals_offline": digest == result["digest"]}
    result |= {"bag": str(output / "bag"), "picture": str(output / "run.png")}
    result["seconds"] = round(time.monotonic() - started, 1)
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


def _target_kmh(scenario: str) -> float:
    return (SCENARIOS[scenario].end_speed_mps or 0.0) / KMH


def _free(wanted: Path) -> Path:
    """The wanted folder, or with the first number behind it that is not taken."""
    numbered = (wanted.with_name(f"{wanted.name}_{number}") for number in count(2))
    return wanted if not wanted.exists() else next(path for path in numbered if not path.exists())


def _play(scenario: str, bag: Path, seed: int) -> str:
    """Run the nodes until the scenario ends; the digest of what the estimator published."""
    with _executor() as executor:
        common: dict[str, Any] = {"context": executor.context}
        settings = [Parameter("scenario", value=scenario), Parameter("seed", value=seed)]
        # First: a bad seed ends here, before anything is written.
        simulator = Simulator(paced=False, parameter_overrides=settings, **common)
        simulated = [Parameter("use_sim_time", value=True)]
        recorder = Recorder(bag, parameter_overrides=simulated, **common)
        estimator = Estimator(parameter_overrides=[*simulated, Parameter("seed", value=seed)], **common)
        monitor = AtpMonitor(
            parameter_overrides=[
                *simulated,
                Parameter("target_position_m", value=6000.0),
                Parameter("target_speed_kmh", value=_target_kmh(scenario)),
            ],
            **common,
        )
        for node in (recorder, estimator, monitor, simulator):
            executor.add_node(node)
        progress = _Progress()
        for ticks in count(1):
            if not simulator.tick():
                break
            _spin_until(executor, partial(_have_heard, ticks, estimator, recorder))
            progress.show(estimator.latest)
        estimator.close()
        _spin_until(executor, lambda: all(recorder.heard[topic] == sent for topic, sent in estimator.published.items()))
        recorder.close()
        return estimator.digest


@contextmanager
def _executor() -> Iterator[SingleThreadedExecutor]:
    """An executor in a context of its own; its nodes are destroyed at the end."""
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    executor = SingleThreadedExecutor(context=context)
    for name in NODES:
        set_logger_level(name, LoggingSeverity.ERROR)
    try:
        yield executor
    finally:
        for name in NODES:
            set_logger_level(name, LoggingSeverity.UNSET)
        nodes = list(executor.get_nodes())
        executor.shutdown()
        for node in nodes:
            node.destroy_node()
        context.try_shutdown()


def _have_heard(positions: int, *nodes: Estimator | Recorder) -> bool:
    return all(node.heard[POSITION] == positions for node in nodes)


def _spin_until(executor: SingleThreadedExecutor, done: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not done():
        if time.monotonic() > deadline:
            raise OSError(f"no message between the nodes for {PATIENCE_S:g} s: is the loopback network there?")
        executor.spin_once(timeout_sec=0.1)


class _Progress:
    """Prints a line about every `SHOWN_EVERY_S` of simulated time on standard error."""

    def __init__(self) -> None:
        self._due_ns = 0
        _say(f"{'time':>7} {'speed':>10} {'mu':>7} {'at least':>9}  regime")

    def show(self, estimate: Estimate | None) -> None:
        """Print the estimate if a line is due."""
        if estimate is None or estimate.t_ns < self._due_ns:
            return
        self._due_ns = estimate.t_ns + round(SHOWN_EVERY_S * 1e9)
        _say(
            f"{estimate.t_ns * 1e-9:5.0f} s {estimate.speed_mps / KMH:5.0f} km/h {estimate.mu:7.4f} "
            f"{estimate.mu_lower:9.4f}  {estimate.regime.name}"
        )


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

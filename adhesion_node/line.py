"""The whole line in one process: simulator, estimator, ATP monitor and recorder, with a simulated clock.

The clock waits for the estimator, so a run does not depend on the machine's speed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from sim_node.node import Simulator

from .core import Estimate
from .nodes.atp_monitor import AtpMonitor
from .nodes.estimator import Estimator
from .nodes.recorder import Recorder
from .topics import POSITION

TARGET_M, STOP_M = 8000.0, 9000.0
"""The target, for a speed or a stop: as near as brakes that come after 20 s at 300 km/h allow on an unknown rail."""

PATIENCE_S = 10.0
"""Longest wait for a message between two nodes of the process."""

NODES = ("recorder", "estimator", "atp_monitor", "simulator", "live")
"""Their errors are shown, the rest of their log is not: who runs the line says himself how far it is."""

Pace = Callable[[int, Estimate | None], bool]
"""Called before every sample with the number of those before and the newest estimate; False ends the run."""


def play(executor: SingleThreadedExecutor, scenario: str, target_kmh: float, bag: Path, seed: int, pace: Pace) -> str:
    """Run the nodes until the scenario or `pace` ends; the digest of what the estimator published.

    However it ends, by a full disk (OSError) or Ctrl-C too, the recording is complete up to there.
    """
    common: dict[str, Any] = {"context": executor.context}
    settings = [Parameter("scenario", value=scenario), Parameter("seed", value=seed)]
    # First: a bad seed ends here, before anything is written.
    simulator = Simulator(paced=False, parameter_overrides=settings, **common)
    simulated = [Parameter("use_sim_time", value=True)]
    recorder = Recorder(bag, parameter_overrides=simulated, **common)
    estimator = Estimator(parameter_overrides=[*simulated, Parameter("seed", value=seed)], **common)
    target = [
        Parameter("target_position_m", value=TARGET_M if target_kmh else STOP_M),
        Parameter("target_speed_kmh", value=target_kmh),
    ]
    monitor = AtpMonitor(parameter_overrides=[*simulated, *target], **common)
    for node in (recorder, estimator, monitor, simulator):
        executor.add_node(node)
    with closing(recorder):
        for ticks in count():
            if not pace(ticks, estimator.latest) or not simulator.tick():
                break
            spin_until(executor, partial(_have_heard, ticks + 1, estimator, recorder))
        estimator.close()
        spin_until(executor, lambda: all(recorder.heard[topic] == sent for topic, sent in estimator.published.items()))
    return estimator.digest


@contextmanager
def executor_of_line() -> Iterator[SingleThreadedExecutor]:
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


def spin_until(executor: SingleThreadedExecutor, done: Callable[[], bool]) -> None:
    """Spin until `done()`; OSError when that takes too long."""
    deadline = time.monotonic() + PATIENCE_S
    while not done():
        if time.monotonic() > deadline:
            raise OSError(f"no message between the nodes for {PATIENCE_S:g} s: is the loopback network there?")
        executor.spin_once(timeout_sec=0.1)


def _have_heard(positions: int, *nodes: Estimator | Recorder) -> bool:
    return all(node.heard[POSITION] == positions for node in nodes)

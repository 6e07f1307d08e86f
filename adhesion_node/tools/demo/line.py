# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The whole line in one process: simulator, estimator, ATP monitor and recorder, with a simulated clock.

The clock waits until all nodes have taken what they were sent, and no node watches the machine's own clock. So a run
depends neither on the machine's speed nor on the order in which the executor turns to the nodes: equal runs leave equal
recordings.
"""

import math
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from sim_node.nodes.simulator import Simulator

from ...core import Estimate
from ...nodes.atp_monitor import AtpMonitor
from ...nodes.estimator import Estimator
from ...nodes.recorder import Recorder
from ...wire.topics import ADHESION_INPUTS, BRAKING_CURVE, STATE

PATIENCE_S = 10.0
"""Longest wait for a message between two nodes of the process."""

NEVER_S = 3600.0
"""By the machine's own clock: longer than a tick can take."""

UNASKED = {"diagnostics_period_s": NEVER_S}
"""Of every node of the line and beside it: each would tell when the machine's clock says so."""

NODES = ("recorder", "estimator", "atp_monitor", "simulator", "live")
"""Their errors are shown, the rest of their log is not: who runs the line says himself how far it is."""

QUIET = {"atp_monitor": LoggingSeverity.FATAL}
"""It brakes until the first estimates are sure enough; its levels are part of the result."""

EVERY_CURVE = {f"qos_overrides./{BRAKING_CURVE.name}.subscription.depth": 100}
"""Of the monitor, which needs the newest curve alone: several come at once where the first estimates have waited."""

DOMAINS = range(1, 102)
"""Domains whose ports are free on every system."""

Pace = Callable[[float, Estimate | None], bool]
"""Called before every sample with its time of the run, s, and the newest estimate; False ends the run."""


class Task(NamedTuple):
    """What the nodes are to do: parameters of each by name, and the seed of simulator and estimator."""

    seed: int
    simulator: Mapping[str, Any]
    monitor: Mapping[str, Any]
    estimator: Mapping[str, Any] = MappingProxyType({})


class Played(NamedTuple):
    """What came of it."""

    digest: str
    """Of what the estimator published."""
    regimes: list[tuple[int, str]]
    """The true ones, and when each began, ns."""


def play(executor: SingleThreadedExecutor, task: Task, bag: Path, pace: Pace) -> Played:
    """Run the nodes until the scenario or `pace` ends.

    However it ends, by a full disk (OSError) or Ctrl-C too, the recording is complete up to there.
    """
    context = executor.context
    # First: a bad seed ends here, before anything is written.
    happening = parameters(**task.simulator, seed=task.seed)
    simulator = Simulator(paced=False, parameter_overrides=happening, context=context)
    simulated = partial(parameters, use_sim_time=True, **UNASKED)
    recorder = Recorder(bag, by_log_time=True, parameter_overrides=simulated(), context=context)
    identifying = simulated(**task.estimator, seed=task.seed, sensor_timeout_s=NEVER_S)
    estimator = Estimator(parameter_overrides=identifying, context=context)
    supervising = simulated(**task.monitor, **EVERY_CURVE, clock_timeout_s=NEVER_S)
    monitor = AtpMonitor(parameter_overrides=supervising, context=context)
    for node in (recorder, estimator, monitor, simulator):
        executor.add_node(node)
    at_rest = partial(_at_rest, simulator, estimator, monitor, recorder)
    with closing(recorder):
        while math.isfinite(simulator.ahead_s) and pace(simulator.ahead_s, estimator.latest):
            simulator.tick()
            spin_until(executor, at_rest)
        estimator.close()
        spin_until(executor, at_rest)
    return Played(estimator.digest, simulator.changes)


@contextmanager
def executor_of_line() -> Iterator[SingleThreadedExecutor]:
    """An executor in a context of its own; its nodes are destroyed at the end.

    It is alone on the machine's network, unless ROS_DOMAIN_ID says where it is to be.
    """
    with own_domain() as domain:
        context = rclpy.Context()
        try:
            rclpy.init(context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        except RuntimeError as error:  # rcl's, as where it has no folder for its log
            raise ValueError(f"ROS does not start: {error}") from error
        yield from _executing(context)


def _executing(context: rclpy.Context) -> Iterator[SingleThreadedExecutor]:
    executor = SingleThreadedExecutor(context=context)
    for name in NODES:
        set_logger_level(name, QUIET.get(name, LoggingSeverity.ERROR))
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


@contextmanager
def own_domain() -> Iterator[int | None]:
    """A domain that no other line on this machine has, and discovery on this machine alone.

    None, which is that of ROS_DOMAIN_ID, where that is set, or where all are taken.
    """
    if "ROS_DOMAIN_ID" in os.environ:
        yield None
        return
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    with ExitStack() as locks:
        yield next((domain for domain in DOMAINS if _claimed(domain, locks)), None)


def _claimed(domain: int, locks: ExitStack) -> bool:
    """Whether this process has the domain now; the system frees it with the end of the process at the latest."""
    claim = locks.enter_context(socket.socket(socket.AF_UNIX))
    try:
        claim.bind(f"\0adhesion_node.domain.{domain}")
    except OSError:
        return False
    return True


def spin_until(executor: SingleThreadedExecutor, done: Callable[[], bool]) -> None:
    """Spin until `done()`; OSError when that takes too long."""
    deadline = time.monotonic() + PATIENCE_S
    while not done():
        if time.monotonic() > deadline:
            raise OSError(f"no message between the nodes for {PATIENCE_S:g} s: is the loopback network there?")
        executor.spin_once(timeout_sec=0.1)


def _at_rest(simulator: Simulator, estimator: Estimator, monitor: AtpMonitor, recorder: Recorder) -> bool:
    """Whether every node has taken what the others sent, and its time is that of the newest sample."""
    sent = simulator.sent + estimator.published + monitor.published
    return (
        all(estimator.heard[topic] == simulator.sent[topic] for topic in ADHESION_INPUTS)
        and all(monitor.heard[topic] == estimator.published[topic] for topic in (STATE, BRAKING_CURVE))
        and all(recorder.heard[topic] == count for topic, count in sent.items())
        and all(node.get_clock().now().nanoseconds == simulator.now_ns for node in (estimator, monitor, recorder))
        and not any(timer.is_ready() for timer in monitor.timers)
    )


def parameters(**values: Any) -> list[Parameter]:
    """Parameters of a node by name."""
    return [Parameter(name, value=value) for name, value in values.items()]

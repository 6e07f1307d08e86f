# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The nodes as programs: signals are taken over first, then the node's module, with numpy and ROS, is imported.

So a Ctrl-C ends a program that is still importing as cleanly as one that spins.
"""

from collections.abc import Callable
from importlib import import_module

from .command.signals import stop_on_signals


def _node(module: str) -> Callable[[], int]:
    def main() -> int:
        with stop_on_signals() as stop:
            program: Callable[[], int] = import_module(module).main
            return 0 if stop.requested else program()

    return main


estimator = _node("adhesion_node.nodes.estimator")
creep_estimator = _node("adhesion_node.nodes.creep_estimator")
atp_monitor = _node("adhesion_node.nodes.atp_monitor")
recorder = _node("adhesion_node.nodes.recorder")
live = _node("adhesion_node.live.__main__")
simulator = _node("sim_node.nodes.simulator")
slip_simulator = _node("sim_node.nodes.slip_simulator")


def replay() -> int:
    """Run `replay`, which is also a tool: it takes the signals over itself where it is a node."""
    with stop_on_signals() as stop:
        program: Callable[[], int] = import_module("adhesion_node.nodes.replay").main
    return 0 if stop.requested else program()

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The programs. Each first takes the signals over, then its module, with numpy and ROS, is imported.

So a Ctrl-C ends a program that is still importing as cleanly as one that spins. A program that needs a package which
is not installed says how to get it: the nodes of a train run with rclpy, numpy, scipy and numba.
"""

import sys
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module

from .command.signals import interrupted, stop_on_signals
from .command.streams import open_closed_streams

Program = Callable[[], int]

_ALWAYS = ("numpy", "scipy", "numba", "yaml")
_EXTRAS = {"aiohttp": "live", "distributed": "cluster"}
"""What brings a package; the others come with `tools`."""


def _main_of(module: str) -> Program:
    program: Program = import_module(module).main
    return program


def _node(module: str) -> Program:
    def main() -> int:
        with stop_on_signals() as stop:
            program = _main_of(module)
            return 0 if stop.requested else program()

    return _saying_what_is_missing(_name_of(module), main)


def _replay() -> int:
    """With --offline it is a tool; else a node, which takes the signals over itself."""
    module = "adhesion_node.nodes.replay"
    if "--offline" in sys.argv[1:]:
        return _tool(module)()
    with stop_on_signals() as stop:
        program = _main_of(module)
    return 0 if stop.requested else program()


def _tool(module: str) -> Program:
    def main() -> int:
        with suppress(KeyboardInterrupt):  # it may come before the program minds it, or after
            with stop_on_signals() as stop:
                program = _main_of(module)
            if not stop.requested:
                return program()
        return interrupted(_name_of(module))

    return _saying_what_is_missing(_name_of(module), main)


def _name_of(module: str) -> str:
    return module.removesuffix(".__main__").rpartition(".")[2]


def _saying_what_is_missing(called: str, program: Program) -> Program:
    def main() -> int:
        open_closed_streams()
        try:
            return program()
        except ModuleNotFoundError as error:
            name = (error.name or "").partition(".")[0]
            if name in ("", __package__, "sim_node"):
                raise
            from .command import options, without_ros  # only here: nothing comes before the signals that is not needed

            if "--version" in sys.argv[1:]:
                print(options.version_of(called))
                return options.DONE
            if without_ros.is_of_ros(name) and without_ros.is_help_asked():
                with without_ros.stand_ins():
                    return program()
            what = "." if name in _ALWAYS else f"'.[{_EXTRAS.get(name, 'tools')}]'"
            remedy = without_ros.REMEDY if without_ros.is_of_ros(name) else f"pip install {what}"
            print(f"{called}: {name} is missing: {remedy}", file=sys.stderr)
            return 2

    return main


estimator = _node("adhesion_node.nodes.estimator")
creep_estimator = _node("adhesion_node.nodes.creep_estimator")
atp_monitor = _node("adhesion_node.nodes.atp_monitor")
recorder = _node("adhesion_node.nodes.recorder")
live = _node("adhesion_node.live.__main__")
simulator = _node("sim_node.nodes.simulator")
slip_simulator = _node("sim_node.nodes.slip_simulator")
replay = _saying_what_is_missing("replay", _replay)
import_csv = _tool("adhesion_node.tools.import_csv")
train = _tool("adhesion_node.tools.train.__main__")
brakings = _tool("adhesion_node.tools.brakings.__main__")
recover = _tool("adhesion_node.tools.recover")
demo = _tool("adhesion_node.tools.demo.__main__")
report = _tool("adhesion_node.report.__main__")
study = _tool("adhesion_node.study.__main__")
bench = _tool("adhesion_node.bench.__main__")

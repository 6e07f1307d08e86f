# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The one main of every node: start, spin until a signal or the node's own end, close, exit code.

rclpy's own signal handlers end in a traceback or a wrong exit code when SIGTERM or a second signal meets a
spinning node. Here the handlers only note the first signal; the loop sees the note between two callbacks.
"""

import argparse
import gc
import inspect
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence

import rclpy
from rclpy.duration import Duration
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, try_shutdown

from adhesion_node.command.signals import StopRequest, stop_on_signals

from ...command.options import BAD_INPUT, DONE, FAILED, complain, complete, help_texts, version_option
from ...core.setting import Setting, by_group
from ...wire.files.parameters import unheeded, without_value
from .remapped import misnamed

POLL_S = 0.1
"""Longest time until a signal is seen: no signal interrupts rclpy's wait."""

DRAIN_S, QUIET_S = 1.0, 0.05
"""After a signal what is queued is still taken: for so long at most, or until nothing has come for so long."""

GOODBYE_S = 0.5
"""Longest wait at the end for reliable subscribers to have the last messages."""

_BAD_START = (ValueError, OSError, RuntimeError, ParameterException, NameValidationException)
"""What a node's start raises for bad input; the RuntimeErrors are those of rcl."""

_UNKNOWN = "UnknownROSArgsError"
"""The one of rclpy, not among its public names, that lists arguments and says nothing of them."""

_NOT_SET = "PARAMETER_NOT_SET"
"""What rclpy says of a parameter without a value, whose name it keeps for itself."""


def run(
    program: str,
    make_node: Callable[[], Node],
    args: Sequence[str] | None = None,
    parameters: Sequence[Setting] = (),
    examples: Sequence[str] = (),
) -> int:
    """Run one node as the program of that name and return its exit code: 0 after a clean stop, 1 failed, 2 bad input.

    `args` are ROS arguments alone, without the program's name (None: those of the command line); anything else
    is refused, a forgotten --ros-args for one. --help shows the first paragraph of the docstring of `make_node`,
    `parameters` and `examples`; both end the program, as argparse does. A ValueError, OSError or rclpy error at
    start is one line on stderr and code 2; an OSError later, a full disk for one, is one line and code 1. Both begin
    with the program's name. The node ends on SIGINT or SIGTERM or when it sets its attribute `finished`; it still
    takes what has come, and its method `close`, if it has one, may publish a last time.
    """
    with stop_on_signals() as stop:
        own, ros = split_ros_arguments(sys.argv[1:] if args is None else args)
        parser = _parser(program, make_node, parameters, examples)
        for hint in _misplaced(own, parameters):
            parser.error(hint)
        parser.parse_args(own)
        try:
            return _start_and_spin(program, make_node, ros, stop)
        finally:
            try_shutdown()


def split_ros_arguments(args: Sequence[str]) -> tuple[list[str], list[str]]:
    """Split a command line into the program's own arguments and those for ROS.

    >>> split_ros_arguments(["--output", "x", "--ros-args", "-p", "a:=1", "--", "y"])
    (['--output', 'x', 'y'], ['--ros-args', '-p', 'a:=1', '--'])
    """
    own: list[str] = []
    ros: list[str] = []
    inside = False
    for argument in args:
        inside = inside or argument == "--ros-args"
        (ros if inside else own).append(argument)
        inside = inside and argument != "--"
    return own, ros


def _misplaced(own: Sequence[str], parameters: Sequence[Setting]) -> Iterator[str]:
    """Say where a parameter goes that was given as an option."""
    names = {one.name for one in parameters}
    for option, following in zip(own, [*own, ""][1:], strict=True):
        name, _, value = option.removeprefix("--").partition("=")
        if option.startswith("--") and name.replace("-", "_") in names:
            given = f"-p {name.replace('-', '_')}:={value or following}"
            yield f"{option}: a node takes its parameters from ROS: --ros-args {given}"


def _parser(
    program: str, make_node: Callable[[], Node], parameters: Sequence[Setting], examples: Sequence[str]
) -> argparse.ArgumentParser:
    """Return the parser of a node's own arguments; asked by a shell, it answers for those of ROS too and ends."""
    purpose, _, _ = inspect.cleandoc(make_node.__doc__ or "").partition("\n\n")  # its own, no base class's
    listed = "\n".join(
        line
        for group, members in by_group(parameters).items()
        for line in (
            f"{group} parameters:".lstrip(),
            *(f"  {one.name} (default: {one.default}): {one.description}; {one.allowed()}" for one in members),
        )
    )
    parser = argparse.ArgumentParser(
        program,
        usage="%(prog)s [--help] [--ros-args -p NAME:=VALUE ... --params-file FILE -r FROM:=TO ...]",
        **help_texts(purpose, *examples, more=listed),
    )
    version_option(parser)
    if "_ARGCOMPLETE" in os.environ:
        parser.add_argument("--ros-args", action="store_true")
        parser.add_argument("-p", "--param", action="append", choices=[f"{one.name}:=" for one in parameters])
        parser.add_argument("--params-file", action="append")
        complete(parser)
    return parser


def _start_and_spin(program: str, make_node: Callable[[], Node], ros: list[str], stop: StopRequest) -> int:
    if stop.requested:
        return DONE
    try:
        rclpy.init(args=ros, signal_handler_options=SignalHandlerOptions.NO)
        node = make_node()
    except _BAD_START as error:
        return complain(program, _named(error, ros), BAD_INPUT)
    for warning in (*unheeded(ros, node.get_fully_qualified_name()), *misnamed(ros, node)):
        node.get_logger().warning(warning)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    gc.freeze()  # what was loaded stays: to look through it all takes 0.1 s, in which nobody is listened to
    try:
        _spin(executor, node, stop)
        return DONE
    except OSError as error:
        return complain(program, error, FAILED)
    finally:
        executor.shutdown()
        node.destroy_node()


def _named(error: Exception, ros: Sequence[str]) -> Exception:
    """An error of rclpy with what it is about, which some leave out."""
    if type(error).__name__ == _UNKNOWN:
        return ValueError(f"ROS arguments {error}: ROS has none such; a parameter is given as -p NAME:=VALUE")
    return ValueError(next(without_value(ros), error)) if _NOT_SET in str(error) else error


def _spin(executor: SingleThreadedExecutor, node: Node, stop: StopRequest) -> None:
    try:
        while not stop.requested and not getattr(node, "finished", False):
            executor.spin_once(timeout_sec=POLL_S)
        _drain(executor, node)
    except ExternalShutdownException:  # the node itself shut rclpy down
        return
    finally:
        close = getattr(node, "close", None)
        if close is not None:
            close()
        if ok():
            _say_goodbye(node)


def _drain(executor: SingleThreadedExecutor, node: Node) -> None:
    """Take the messages that are queued; the timers, which would go on for ever, are over."""
    for timer in node.timers:
        timer.cancel()
    end = time.monotonic() + DRAIN_S
    while time.monotonic() < end:
        try:
            # with another time than before the executor would begin again at the first topic, and empty that first
            work, *_ = executor.wait_for_ready_callbacks(timeout_sec=QUIET_S)
        except TimeoutException:
            return
        work()
        work.result()  # raises what the callback raised


def _say_goodbye(node: Node) -> None:
    deadline = time.monotonic() + GOODBYE_S
    for publisher in node.publishers:
        publisher.wait_for_all_acked(Duration(seconds=max(deadline - time.monotonic(), 0.0)))

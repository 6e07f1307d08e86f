# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A node, a driver that publishes to it, and what the node says on /diagnostics."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from recorded import write_steps

from adhesion_node.bag import BagReader, select
from adhesion_node.live.node import Live
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from adhesion_node.wire.topic import Topic

S = 10**9


class Line:
    """A node, what it says, and a driver that publishes to it."""

    def __init__(
        self, executor: SingleThreadedExecutor, spin_until: SpinUntil, make: Callable[..., Node], **given: Any
    ) -> None:
        context, namespace = executor.context, given.pop("namespace", None)
        overrides = [Parameter(name, value=value) for name, value in given.items()]
        self.executor, self.spin_until = executor, spin_until
        self.node: Any = make(context=context, namespace=namespace, parameter_overrides=overrides)
        self.driver = Node("driver", context=context, namespace=namespace)
        self.told: list[DiagnosticArray] = []
        qos.subscribe(self.driver, topics.DIAGNOSTICS, self.told.append)
        for node in (self.node, self.driver):
            executor.add_node(node)
        own = sum(end.topic_name == topics.DIAGNOSTICS.name for end in self.node.subscriptions)
        spin_until(executor, lambda: self.node.count_subscribers(topics.DIAGNOSTICS.name) == 1 + own)

    def outlet(self, topic: Topic) -> Any:
        output = qos.advertise(self.driver, topic)
        self.spin_until(self.executor, output.get_subscription_count)
        return output

    def wait(self, done: Callable[[], object], timeout_s: float = 10.0) -> None:
        self.spin_until(self.executor, done, timeout_s)

    def wait_until_said(self, words: str) -> None:
        """Wait for a message with these words that is said from now on."""
        self.told.clear()
        self.wait(lambda: any(words in array.status[0].message for array in self.told))

    def wait_for_values(self, **wanted: str) -> None:
        """Wait for these values among those that are told."""
        self.wait(lambda: self.told and wanted.items() <= self.values.items())

    @property
    def values(self) -> dict[str, str]:
        return {pair.key: pair.value for pair in self.last.values}

    @property
    def last(self) -> DiagnosticStatus:
        (status,) = self.told[-1].status
        return status


@pytest.fixture
def make_line(executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Callable[..., Line]:
    return lambda make, **given: Line(executor, spin_until, make, **given)


@pytest.fixture
def beside(tmp_path: Path) -> Iterator[dict[Any, Callable[..., Node]]]:
    """The nodes that take more than parameters, with it; closed at the end. The player has 40 steps."""
    write_steps(tmp_path / "played", 40)
    with ExitStack() as stack:
        reader = stack.enter_context(BagReader(tmp_path / "played"))

        def closed(make: Callable[..., Any], *given: Any, **others: Any) -> Any:
            return stack.enter_context(closing(make(*given, **others)))

        yield {
            Recorder: partial(closed, Recorder, tmp_path / "bag"),
            Replay: partial(Replay, reader, select(reader.topics), 0.0, 0),
            Live: partial(closed, Live, "127.0.0.1", 0),
        }

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A node whose parameters are declared by a test."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Protocol

import pytest
from rclpy.clock import ROSClock
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.setting import Setting
from adhesion_node.nodes.ros.params import SettingsNode

SPECS = (
    Setting("start_mu", 0.09, "first guess of the adhesion coefficient", low=0.0, high=0.5),
    Setting("particles", 20, "number of particles", low=2),
    Setting("law", "wet", "speed law", choices=("dry", "wet")),
    Setting("verbose", False, "say more"),
    Setting("output", "bag", "where to"),
    Setting("length_m", 200.0, "length of the train", "m"),
)
DEFAULTS = {"start_mu": 0.09, "particles": 20, "law": "wet", "verbose": False, "output": "bag", "length_m": 200.0}


class Make(Protocol):
    """Type of the fixture `make`."""

    def __call__(self, overrides: dict[str, Any] | None = None, *, automatic: bool = True) -> SettingsNode: ...


@pytest.fixture
def make(context: Context) -> Iterator[Make]:
    """Make nodes with given parameters; they are destroyed after the test."""
    made: list[SettingsNode] = []

    def _make(overrides: dict[str, Any] | None = None, *, automatic: bool = True) -> SettingsNode:
        node = SettingsNode(
            "probe",
            context=context,
            parameter_overrides=[Parameter(name, value=value) for name, value in (overrides or {}).items()],
            automatically_declare_parameters_from_overrides=automatic,
        )
        made.append(node)
        return node

    yield _make
    for node in made:
        node.destroy_node()


def follows_clock(node: Node) -> bool:
    clock = node.get_clock()
    assert isinstance(clock, ROSClock)
    return clock.ros_time_is_active


@pytest.fixture(params=[True, False], ids=["automatic", "declared"])
def automatic(request: pytest.FixtureRequest) -> bool:
    return bool(request.param)


def typed(values: Iterable[object]) -> list[tuple[type, object]]:
    return [(type(value), value) for value in values]

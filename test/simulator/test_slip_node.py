# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The slip simulator as a node: what it publishes, in which order, and how it ends."""

from __future__ import annotations

from typing import Any

import pytest
from published import Sent, by_topic, sent
from rclpy.context import Context
from rclpy.parameter import Parameter

from adhesion_node.wire.topics import CLOCK, CREEP_INPUTS, SPEED, TRACTION_FORCE, TRUTH_MU, WHEEL_SPEED
from sim_node.nodes.slip_simulator import SlipSimulator
from sim_node.slip import plant as slip
from sim_node.slip.scenario import find

__all__ = ["sent"]


def _simulator(context: Context, **parameters: Any) -> SlipSimulator:
    overrides = [Parameter(name, value=value) for name, value in parameters.items()]
    return SlipSimulator(paced=False, context=context, parameter_overrides=overrides)


def test_a_sample_is_published_in_order_with_one_stamp(context: Context, sent: Sent) -> None:
    simulator = _simulator(context, start_time_s=12.5, scenario="creep_dry", seed=3)
    for _ in range(3):
        assert simulator.tick()
    order = ["/clock", "/truth/mu", "/speed", "/traction_force", "/wheel_speed"]
    assert [topic for topic, _ in sent] == order * 3
    lists = by_topic(sent)
    expected = list(zip(range(3), slip.run(find("creep_dry"), 0.01, 3), strict=False))
    for index, (truth, measured) in expected:
        t_ns = 12_500_000_000 + index * 10_000_000
        assert SPEED.read(lists["/speed"][index]) == (t_ns, measured.speed_mps, pytest.approx(0.003**2))
        assert TRACTION_FORCE.read(lists["/traction_force"][index]) == (t_ns, measured.force_n)
        assert WHEEL_SPEED.read(lists["/wheel_speed"][index]) == (t_ns, measured.wheel_radps)
        assert lists["/truth/mu"][index].data == truth.mu_max
    assert list(lists["/wheel_speed"][0].name) == [f"axle_{number}" for number in range(1, 7)]
    assert lists["/speed"][0].twist.covariance[0] == pytest.approx(0.003**2)
    simulator.destroy_node()


def test_a_run_ends_and_finishes(context: Context, sent: Sent) -> None:
    simulator = _simulator(context, rate_hz=2.0, scenario="creep_dry")
    assert sum(1 for _ in iter(simulator.tick, False)) == 81
    assert simulator.finished
    assert {topic.lstrip("/") for topic, _ in sent} == {
        topic.name.lstrip("/") for topic in (CLOCK, TRUTH_MU, *CREEP_INPUTS)
    }
    simulator.destroy_node()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"scenario": "mud"}, r"scenario = 'mud': choose one of creep_dry, creep_switch"),
        ({"speed_std_mps": -0.1}, r"speed_std_mps = -0\.1: give"),
        ({"rate_hz": 0.0}, r"rate_hz = 0\.0: give"),
    ],
)
def test_bad_parameters_are_refused(context: Context, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        _simulator(context, **parameters)

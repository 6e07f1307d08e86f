# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Twenty trains in one process, on one executor: each is told of its own sensors, of all of them, and of no other's."""

from functools import partial

import messages
import pytest
from conftest import SpinUntil
from rclpy.context import Context
from rclpy.node import Node

from adhesion_node.bench.trains import EXECUTORS
from adhesion_node.core.intake.samples import PositionSample, PressureSample
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire.line import ATMOSPHERE_PA
from adhesion_node.wire.settings.setup import setup_of
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION

TRAINS, SAMPLES = 20, 40
FULL_PA = 410e3


@pytest.mark.parametrize("kind", EXECUTORS)
def test_of_twenty_trains_in_one_process_no_message_is_lost(kind: str, context: Context, spin_until: SpinUntil) -> None:
    """The messages of all come at once; the digest of each is that of its own messages, offline."""
    executor = EXECUTORS[kind](context=context)
    driver = Node("driver", context=context)
    trains = [Estimator(namespace=f"train{k}", context=context) for k in range(TRAINS)]
    outputs = [
        [qos.advertise(driver, topic._replace(name=f"train{k}/{topic.name}")) for topic in (BRAKE_PRESSURE, POSITION)]
        for k in range(TRAINS)
    ]
    try:
        for node in (driver, *trains):
            executor.add_node(node)
        spin_until(executor, lambda: all(end.get_subscription_count() for pair in outputs for end in pair), 60.0)
        for n in range(SAMPLES):
            for k, (by_pressure, by_position) in enumerate(outputs):
                by_pressure.publish(messages.brake_pressure(stamp(n), FULL_PA + ATMOSPHERE_PA, 0.0))
                by_position.publish(messages.position(stamp(n), place_m(k, n), 0.5))
            spin_until(executor, partial(heard, trains, n + 1), 60.0)
        for train in trains:
            train.close()
        assert [(one.heard[BRAKE_PRESSURE], one.heard[POSITION]) for one in trains] == [(SAMPLES, SAMPLES)] * TRAINS
        assert [one.digest for one in trains] == [offline(k) for k in range(TRAINS)]
    finally:
        executor.shutdown()
        for node in (driver, *trains):
            node.destroy_node()


def heard(trains: list[Estimator], count: int) -> bool:
    return all(train.heard[topic] == count for train in trains for topic in (BRAKE_PRESSURE, POSITION))


def stamp(n: int) -> int:
    return 10**9 + n * 10**8


def place_m(train: int, n: int) -> float:
    """Braking at 0.7 m/s², from another speed for each train."""
    return (40.0 + train) * 0.1 * n - 0.35 * (0.1 * n) ** 2


def offline(train: int) -> str:
    pipeline = Pipeline(setup_of({}).config, 1)
    for n in range(SAMPLES):
        pipeline.push(PressureSample(stamp(n), FULL_PA))
        pipeline.push(PositionSample(stamp(n), place_m(train, n), 0.25))
    pipeline.finish()
    return pipeline.digest

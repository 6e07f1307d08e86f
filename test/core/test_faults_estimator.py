# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The estimator as a node under the simulator's faults: what it publishes, counts and says to the operator."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import messages
import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticStatus
from estimator_line import FAST, Line
from faulty import READERS, S
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from adhesion_node.nodes.estimator import Estimator
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire import topics
from adhesion_node.wire.settings.setup import setup_of
from sim_node.faults.plan import Plan, faulty_run
from sim_node.train.scenario import find
from sim_node.train.sensors import SensorMessage, SensorSettings, Tick

SENSORS = SensorSettings(speed_std_mps=0.3)
MakeLine = Callable[..., Line]


@pytest.fixture
def make_line(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> MakeLine:
    """Return a function that makes an estimator with given parameters and its driver."""

    def make(**parameters: Any) -> Line:
        overrides = [Parameter(name, value=value) for name, value in (FAST | parameters).items()]
        estimator = Estimator(context=context, parameter_overrides=overrides)
        driver = Node("driver", context=context, parameter_overrides=overrides)
        return Line(executor, spin_until, estimator, driver)

    return make


def ticks(fault: str, begin_s: float = 15.0, end_s: float = 27.0, **dose: float) -> list[Tick]:
    """Return a part of tunnel_entry, 10 Hz, whose brake comes on at 20 s and whose fault at 22 s."""
    plan = Plan(fault, 22.0, **{f"fault_{name}": value for name, value in dose.items()})
    run = faulty_run(plan, find("tunnel_entry"), 0.1, 1, SENSORS)
    return [tick for tick in run if begin_s * S <= tick[0].t_ns < end_s * S]


def play(line: Line, run: Iterable[Tick]) -> None:
    for _, sent in run:
        for message in sent:
            line.send(message.topic, messages.message_of(message))


def flat(run: Iterable[Tick]) -> list[SensorMessage]:
    return [message for _, sent in run for message in sent]


def offline_digest(run: Iterable[Tick], **parameters: Any) -> str:
    """Digest of the same messages straight through a pipeline."""
    pipeline = Pipeline(setup_of(FAST | parameters).config, 1)
    for message in flat(run):
        pipeline.push(READERS[message.topic](messages.message_of(message)))
    pipeline.finish()
    return pipeline.digest


def last(line: Line) -> DiagnosticStatus:
    (status,) = line.heard[topics.DIAGNOSTICS][-1].status
    return status


def said(line: Line, *words: str) -> Callable[[], bool]:
    """Return whether a status with all these words has been heard."""

    def heard() -> bool:
        texts = [message.status[0].message for message in line.heard[topics.DIAGNOSTICS]]
        return any(all(word in text for word in words) for text in texts)

    return heard


def is_stale(line: Line) -> Callable[[], bool]:
    return lambda: bool(line.heard[topics.DIAGNOSTICS]) and last(line).level == DiagnosticStatus.STALE


@pytest.mark.parametrize("fault", ["nan", "inf", "huge", "negative_variance"])
def test_what_nobody_can_use_changes_no_bit(make_line: MakeLine, fault: str) -> None:
    line = make_line()
    run = ticks(fault, share=0.3)
    play(line, run)
    line.estimator.close()
    line.hear_all()
    assert line.estimator.digest == offline_digest(ticks("none"))
    dropped = sum(int(value) for key, value in line.values().items() if key.startswith("dropped."))
    assert dropped == len(flat(run)) - len(flat(ticks("none"))) > 10
    assert_published_is_sound(line)


def assert_published_is_sound(line: Line) -> None:
    """No number that is not finite; stamps strictly increase on every topic."""
    for heard in line.heard.values():
        stamps = [message.header.stamp.sec * S + message.header.stamp.nanosec for message in heard if stamped(message)]
        assert all(later > earlier for earlier, later in pairwise(stamps))
    for topic in topics.RESULTS:
        assert not re.search(r"[=\[ (]-?(nan|inf)\b", repr(line.heard[topic]))


def stamped(message: Any) -> bool:
    return hasattr(message, "header")


@pytest.mark.parametrize(
    ("fault", "remedy"),
    [
        ("wrong_frame", "header.frame_id = 'map', frame = 'track': set header.frame_id"),
        ("kmh", "speed is in m/s, not km/h"),
    ],
)
def test_the_first_mistaken_message_is_flagged_with_the_remedy(make_line: MakeLine, fault: str, remedy: str) -> None:
    line = make_line()
    run = ticks(fault, end_s=22.1)
    play(line, run)
    line.hear_all()
    assert last(line).level == DiagnosticStatus.WARN
    assert remedy in last(line).message
    assert "(1 so far)" in last(line).message


def test_each_sensor_has_a_count_of_its_own(make_line: MakeLine) -> None:
    line = make_line()
    for _ in range(3):
        line.send(topics.POSITION, messages.position(S, math.nan, 0.5))
    line.send(topics.SPEED, messages.speed(S, math.nan, 0.1))
    line.hear_all()
    remedy = "give a finite number, or publish nothing while there is none"
    for topic, count in (("position", 3), ("speed", 1)):
        assert f"{topic}: message refused: {topic} x = nan: {remedy} ({count} so far)" in last(line).message
    assert line.values()["dropped.NOT_FINITE"] == "4"


def test_a_gauge_pressure_shows_while_the_brake_is_released(make_line: MakeLine) -> None:
    line = make_line()
    line.send(topics.BRAKE_PRESSURE, messages.brake_pressure(S, 0.0, 0.0))
    line.hear_all()
    assert "add 101325 Pa to a gauge pressure" in last(line).message


def test_an_empty_frame_is_flagged(make_line: MakeLine) -> None:
    line = make_line()
    message = messages.position(S, 1.0, 0.5)
    message.header.frame_id = ""
    line.send(topics.POSITION, message)
    line.hear_all()
    assert "header.frame_id = '', frame = 'track': set header.frame_id" in last(line).message


def test_a_stuck_position_is_an_error_and_nothing_is_said_of_mu(make_line: MakeLine) -> None:
    line = make_line()
    play(line, ticks("stuck", begin_s=10.0, end_s=24.0))
    line.hear_all()
    assert last(line).level == DiagnosticStatus.ERROR
    assert last(line).message.startswith("position: the same to the bit although the train must have moved on")
    errors = [m.status[0] for m in line.heard[topics.DIAGNOSTICS] if m.status[0].level == DiagnosticStatus.ERROR]
    assert int(next(pair.value for pair in errors[0].values if pair.key == "stamp_ns")) < 24 * S
    known = len(line.heard[topics.MU])
    play(line, ticks("stuck", begin_s=24.0, end_s=28.0))
    line.hear_all()
    assert len(line.heard[topics.MU]) == len(line.heard[topics.MU_LOWER]) == known
    assert line.heard[topics.BRAKING_CURVE][-1].header.stamp.sec >= 26
    assert_published_is_sound(line)


def test_reset_starts_anew(make_line: MakeLine) -> None:
    line = make_line()
    play(line, ticks("none", end_s=21.0))
    response = call(line, Trigger, "/estimator/reset", Trigger.Request())
    assert response.success
    line.hear_all()
    assert line.values()["resets"] == "1"
    play(line, ticks("none", begin_s=21.0, end_s=27.0))
    line.hear_all()
    assert int(line.values()["window"]) > 0


def test_disabled_it_counts_and_says_so_and_enabled_it_goes_on(make_line: MakeLine) -> None:
    line = make_line()
    play(line, ticks("none", end_s=21.0))
    assert call(line, SetBool, "/estimator/set_enabled", SetBool.Request(data=False)).success
    line.hear_all()
    published = line.estimator.published[topics.MU]
    play(line, ticks("none", begin_s=21.0, end_s=22.0))
    line.hear_all()
    assert line.estimator.published[topics.MU] == published
    assert "disabled: call ~/set_enabled with true to go on" in last(line).message
    assert call(line, SetBool, "/estimator/set_enabled", SetBool.Request(data=True)).success
    play(line, ticks("none", begin_s=22.0, end_s=28.0))
    line.hear_all()
    assert line.values()["dropped.DISABLED"] == "30"
    assert line.estimator.published[topics.MU] > published
    assert last(line).level == DiagnosticStatus.OK


def call(line: Line, kind: type[Any], name: str, request: Any) -> Any:
    client = line.driver.create_client(kind, name)
    line.spin_until(line.executor, client.service_is_ready)
    future = client.call_async(request)
    line.spin_until(line.executor, future.done)
    return future.result()


def heard_at_least(line: Line, count: int) -> bool:
    return line.estimator.heard[topics.POSITION] >= count


def test_a_flood_is_bounded_work(make_line: MakeLine) -> None:
    """10 kHz for 0.3 s of stamps: at most 200 a second are used, the log does not grow with it."""
    line = make_line(diagnostics_period_s=3600.0, sensor_timeout_s=60.0)  # a silence, as of a busy machine, begins anew
    for tick in range(3000):
        line.outputs[topics.POSITION].publish(messages.position(S + tick * S // 10_000, 0.008 * tick, 0.5))
        if tick % 50 == 49:  # in one process: give the node its turn before its queue of 100 is full
            line.spin_until(line.executor, partial(heard_at_least, line, tick))
    line.spin_until(line.executor, partial(heard_at_least, line, 3000))
    line.estimator.report()
    line.hear_all()
    assert int(line.values()["accepted"]) <= 61
    assert line.estimator.published[topics.DIAGNOSTICS] < 30


@pytest.mark.parametrize(("particles", "shown"), [(0, "0"), (10**9, "1000000000"), (20.5, "20.5"), ("many", "'many'")])
def test_an_impossible_number_of_particles_is_refused_at_start(context: Context, particles: Any, shown: str) -> None:
    with pytest.raises(ValueError, match=rf"particles = {shown}: give .*a value from 2 to 100000"):
        Estimator(context=context, parameter_overrides=[Parameter("particles", value=particles)])


def test_nothing_changes_while_it_runs(make_line: MakeLine) -> None:
    line = make_line()
    changes: Sequence[tuple[str, Any]] = (
        ("particles", 0),
        ("particles", "many"),
        ("window", 60),
        ("sensor_timeout_s", 1),
    )
    for name, value in changes:
        result = line.estimator.set_parameters_atomically(
            [Parameter("start_mu", value=0.1), Parameter(name, value=value)]
        )
        assert not result.successful
        assert name in result.reason or "start_mu" in result.reason
    assert line.estimator.get_parameter("start_mu").value == 0.05

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The estimator as a node under the simulator's faults: what it publishes, counts and says to the operator."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import messages
import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticStatus
from faulty import READERS, S
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_srvs.srv import SetBool, Trigger
from test_estimator_node import FAST, Line

from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire import topics
from adhesion_node.wire.settings import setup_of
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


def test_late_messages_within_the_lag_and_duplicates_give_the_ordered_run(make_line: MakeLine) -> None:
    lag = {"max_lag_s": 0.5}
    line = make_line(**lag)
    late = ticks("late", size=0.3, share=0.3)
    doubled = [(truth, sent * 2) for truth, sent in late]
    play(line, doubled)
    line.estimator.close()
    line.hear_all()
    in_order = sorted(flat(late), key=lambda message: message.t_ns)
    assert in_order != flat(late)
    assert line.estimator.digest == offline_digest(
        [(tick[0], (m,)) for tick, m in zip([late[0]] * len(in_order), in_order, strict=True)], **lag
    )
    assert int(line.values()["dropped.DUPLICATE"]) == sum(
        len([m for m in sent if m.topic == topics.POSITION]) for _, sent in late
    )


def test_messages_older_than_the_lag_are_dropped_and_counted(make_line: MakeLine) -> None:
    line = make_line(max_lag_s=0.1)
    play(line, ticks("late", size=0.5, share=0.3))
    line.hear_all()
    assert int(line.values()["dropped.LATE"]) > 5


@pytest.mark.parametrize("fault", ["stamps_back", "stamps_forward"])
def test_a_jump_of_the_stamps_is_one_reset_and_estimates_come_again(make_line: MakeLine, fault: str) -> None:
    line = make_line()
    play(line, ticks(fault, end_s=30.0))
    line.hear_all()
    values = line.values()
    assert values["resets"] == "1"
    assert int(values["window"]) >= 50


def test_a_paused_clock_is_one_reset_and_estimates_come_again(make_line: MakeLine) -> None:
    """The train brakes on for 13 s without the time moving: ten positions far off, and it is taken to be elsewhere."""
    line = make_line()
    run = [
        (t, tuple(m._replace(t_ns=22 * S) if t.t_ns < 35 * S else m._replace(t_ns=m.t_ns - 13 * S) for m in sent))
        if t.t_ns >= 22 * S
        else (t, sent)
        for t, sent in ticks("none", end_s=45.0)
    ]
    play(line, run)
    line.hear_all()
    values = line.values()
    assert values["resets"] == "1"
    assert int(values["window"]) >= 50


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


def test_silence_is_stale_within_the_timeout_and_a_tick(make_line: MakeLine) -> None:
    line = make_line(sensor_timeout_s=0.2)
    play(line, ticks("none", end_s=17.0))
    before = line.estimator.published[topics.DIAGNOSTICS]  # a busy machine may have been silent meanwhile, too
    told = line.heard[topics.DIAGNOSTICS]
    line.spin_until(line.executor, lambda: len(told) > before and is_stale(line)())
    first = next(m for m in told[before:] if m.status[0].level == DiagnosticStatus.STALE)
    assert first.status[0].message.startswith("/position: nothing for 0.2 s: is the sensor alive?")
    before = line.estimator.published[topics.DIAGNOSTICS]
    play(line, ticks("none", begin_s=17.2, end_s=18.4))
    line.hear_all()
    assert DiagnosticStatus.OK in [message.status[0].level for message in told[before:]]
    assert_published_is_sound(line)


def test_a_sensor_never_heard_is_stale(make_line: MakeLine) -> None:
    line = make_line(sensor_timeout_s=0.1)
    line.spin_until(line.executor, is_stale(line))
    assert "/position or /odometry: nothing received yet, publishers: 2" in last(line).message


def test_with_sim_time_silence_is_measured_by_the_clock(make_line: MakeLine) -> None:
    line = make_line(use_sim_time=True)
    clock = qos.advertise(line.driver, topics.CLOCK, qos.SENSOR_PUBLISHER)
    estimator_clock = line.estimator.get_clock()

    def turn_to(t_s: int) -> None:
        clock.publish(messages.clock(t_s * S))
        line.spin_until(line.executor, lambda: estimator_clock.now().nanoseconds == t_s * S)

    line.spin_until(line.executor, clock.get_subscription_count)
    turn_to(100)
    line.send(topics.POSITION, messages.position(S, 1.0, 0.5))
    turn_to(107)
    line.spin_until(line.executor, said(line, "/position: nothing for 7.0 s"))


def test_a_second_clock_is_told(make_line: MakeLine) -> None:
    line = make_line(use_sim_time=True)
    clocks = [qos.advertise(line.driver, topics.CLOCK, qos.SENSOR_PUBLISHER) for _ in range(2)]
    line.spin_until(line.executor, lambda: line.estimator.count_publishers("/clock") == 2)
    for clock in clocks:
        clock.publish(messages.clock(S))
    line.spin_until(line.executor, lambda: line.estimator.get_clock().now().nanoseconds == S)
    play(line, ticks("none", end_s=16.5))
    line.hear_all()
    assert "2 publishers of /clock" in last(line).message


RELIABLE = {"qos_overrides./position.subscription.reliability": "reliable"}


def test_a_publisher_that_offers_too_little_is_told_with_the_remedy(make_line: MakeLine) -> None:
    line = make_line(**RELIABLE)
    line.driver.create_publisher(
        messages.message_class(topics.POSITION),
        "position",
        QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT),
    )
    told = said(line, "less reliability", "-p qos_overrides./position.subscription.reliability:=best_effort")
    line.spin_until(line.executor, told, 1.0)


def test_a_subscriber_that_asks_too_much_is_told(make_line: MakeLine) -> None:
    line = make_line()
    line.driver.create_subscription(messages.message_class(topics.MU), topics.MU.name, print, qos.LATCHED)
    line.spin_until(line.executor, said(line, "/adhesion/mu: a subscriber asks for more durability"), 1.0)


def test_a_missed_deadline_is_told(make_line: MakeLine) -> None:
    deadline = {f"qos_overrides./position.{end}.deadline": S // 10 for end in ("subscription", "publisher")}
    line = make_line(**deadline)
    line.send(topics.POSITION, messages.position(S, 1.0, 0.5))
    line.spin_until(line.executor, said(line, "/position: deadline missed"), 1.0)


def test_a_publisher_that_shows_no_life_is_told(make_line: MakeLine) -> None:
    """It promised to assert its liveliness every 0.1 s and does so by publishing only."""
    promise: dict[str, Any] = {}
    for end in ("subscription", "publisher"):
        promise[f"qos_overrides./position.{end}.liveliness"] = "manual_by_topic"
        promise[f"qos_overrides./position.{end}.liveliness_lease_duration"] = S // 10
    line = make_line(**promise)
    line.send(topics.POSITION, messages.position(S, 1.0, 0.5))
    line.spin_until(line.executor, said(line, "/position: a publisher shows no life, 0 left"), 1.0)


def test_a_publisher_that_goes_is_told_and_stands_for_as_long_as_the_silence(make_line: MakeLine) -> None:
    line = make_line(sensor_timeout_s=0.1)
    line.send(topics.POSITION, messages.position(S, 1.0, 0.5))
    line.driver.destroy_publisher(line.outputs[topics.POSITION])
    line.spin_until(line.executor, said(line, "/position: a publisher has gone, 0 left"), 1.0)
    line.spin_until(line.executor, said(line, "/position: nothing for 0.1 s", "/position: a publisher has gone"))


def test_who_comes_late_gets_no_old_curve(make_line: MakeLine) -> None:
    """The safe curve lives for 0.1 s here and the nominal one, the control, for its 5 s."""
    line = make_line(**{"qos_overrides./adhesion/braking_curve.publisher.lifespan": S // 10})
    play(line, ticks("none", end_s=22.0))
    line.hear_all()
    expired = time.monotonic() + 0.2
    line.spin_until(line.executor, lambda: time.monotonic() > expired)
    late: dict[topics.Topic, list[Any]] = {topics.BRAKING_CURVE: [], topics.BRAKING_CURVE_NOMINAL: []}
    for topic, heard in late.items():
        line.driver.create_subscription(messages.message_class(topic), topic.name, heard.append, qos.LATCHED)
    line.spin_until(line.executor, lambda: late[topics.BRAKING_CURVE_NOMINAL])
    assert late[topics.BRAKING_CURVE] == []


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
    line = make_line()
    for tick in range(3000):
        line.outputs[topics.POSITION].publish(messages.position(S + tick * S // 10_000, 0.008 * tick, 0.5))
        if tick % 50 == 49:  # in one process: give the node its turn before its queue of 100 is full
            line.spin_until(line.executor, partial(heard_at_least, line, tick))
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

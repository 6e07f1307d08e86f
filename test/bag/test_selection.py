# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which topics of a recording are whose: names, renamed ones, and what does not fit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from adhesion_node.bag import BagReader, choose_train, overlooked, parse_remap, select
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import (
    BRAKE_PRESSURE,
    CLOCK,
    FIX,
    IMU,
    MU,
    ODOMETRY,
    POSITION,
    RECORDED,
    SPEED,
    WHEEL_SPEED,
)

RECORDED_ELSEWHERE = {"/odo/pose": POSITION.type, "/brake_pressure": BRAKE_PRESSURE.type, "/x": MU.type}


def test_selection_renames_and_takes_sensors_and_truth_alone() -> None:
    own = {f"/{topic.name}": topic.type for topic in RECORDED} | {CLOCK.name: CLOCK.type}
    places = ("position", "fix", "odometry")
    sensors = (*places, "brake_pressure", "brake_demand", "speed", "imu", "wheel_speed", "traction_force")
    assert select(own) == {f"/{name}": name for name in (*sensors, "truth/state", "truth/mu", "truth/limited")}
    creep = {"/wheel_speed": WHEEL_SPEED.type}
    assert select(creep) == {"/wheel_speed": "wheel_speed"}, "a recording for the creep curve needs no position"
    for other in (FIX, ODOMETRY):
        assert select({f"/{other.name}": other.type}) == {f"/{other.name}": other.name}, "it is a position, too"
    remapped = select(RECORDED_ELSEWHERE, [parse_remap("odo/pose:=/position")])
    assert remapped == {"/odo/pose": "position", "/brake_pressure": "brake_pressure"}
    assert select(RECORDED_ELSEWHERE, [], ["brake_pressure", "/x"]) == {"/brake_pressure": "brake_pressure", "/x": "/x"}
    displaced = select(own | {"/gnss": POSITION.type}, [("/gnss", "position")], ["position"])
    assert displaced == {"/gnss": "position"}


@pytest.mark.parametrize(
    ("remaps", "names", "message"),
    [
        ([], None, r"topic position: not in the recording\. It holds: /brake_pressure \(.*--remap /odo/pose:=position"),
        ([("/odo", "position")], None, r"remap from /odo: not in the recording\. It holds: .*--remap /odo/pose:="),
        ([("/x", "position")], None, r"topic /x: type = std_msgs/msg/Float64: position needs geometry_msgs/msg/Pose"),
        ([], ["speed"], r"topic speed: not in the recording\. .*--remap /recorded/name:=speed"),
    ],
)
def test_a_selection_that_does_not_fit_says_so(
    remaps: list[tuple[str, str]], names: list[str] | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        select(RECORDED_ELSEWHERE, remaps, names)


@pytest.mark.parametrize("topic", [FIX, ODOMETRY, SPEED, WHEEL_SPEED])
def test_without_a_position_what_stands_in_for_one_is_to_be_named(topic: Topic) -> None:
    """A receiver's fix was to be named `position`, and then refused for its type."""
    with pytest.raises(ValueError, match=f"topic position: not in .*--remap /theirs:={topic.name}$"):
        select({"/theirs": topic.type, "/brake_pressure": BRAKE_PRESSURE.type})
    with pytest.raises(ValueError, match=r"No type of these tells where or how fast it runs: write a CSV for import_"):
        select({"/speed_kmh": MU.type, "/adhesion/state": ODOMETRY.type})


@pytest.mark.parametrize("text", ["", "a", "a:=", ":=b", "a:=b:=c", "/:=b"])
def test_a_remap_without_two_names_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"write FROM:=TO, for instance /odometry/position:=position"):
        parse_remap(text)


OF_A_TRAIN = {f"/{topic.name}": topic.type for topic in (POSITION, BRAKE_PRESSURE)}


def chosen(recorded: dict[str, str], wanted: str | None = None) -> str:
    reader = SimpleNamespace(topics=recorded, path="bag", namespace="")
    choose_train(cast(BagReader, reader), wanted)
    return cast(str, reader.namespace)


def within(space: str, topics: dict[str, str] = OF_A_TRAIN) -> dict[str, str]:
    return {f"{space}{name}": kind for name, kind in topics.items()}


def test_the_train_without_a_namespace_counts_first_then_the_only_one() -> None:
    assert chosen(OF_A_TRAIN | within("/train1")) == chosen(OF_A_TRAIN) == chosen({}) == ""
    assert chosen(OF_A_TRAIN | within("/train1"), "train1") == chosen(within("/train1")) == "/train1"
    assert chosen({"/a/b/adhesion/mu": MU.type, "/imu": "sensor_msgs/msg/Imu"}) == "/a/b"
    for no_train in ({"/gnss/position": POSITION.type}, within("/a", {"/position": "x", "/brake_pressure": "y"})):
        assert chosen(no_train) == ""


def test_a_train_is_selected_by_its_namespace_alone() -> None:
    both = within("/a") | within("/b")
    assert select(both, namespace="/b") == {"/b/position": "position", "/b/brake_pressure": "brake_pressure"}
    mended = select(both, [("/a/brake_pressure", "brake_pressure")], namespace="/b")
    assert mended == {"/b/position": "position", "/a/brake_pressure": "brake_pressure"}


def test_what_could_be_a_sensor_under_another_name_is_said() -> None:
    elsewhere = {"/wheel_speed": WHEEL_SPEED.type, "/odom": ODOMETRY.type, "/gnss/fix": FIX.type, "/xsens": IMU.type}
    assert list(overlooked(elsewhere, select(elsewhere))) == [
        "no position is read; could it be /gnss/fix (sensor_msgs/msg/NavSatFix), /odom (nav_msgs/msg/Odometry)? "
        "--remap /gnss/fix:=fix",
        "no imu is read; could it be /xsens (sensor_msgs/msg/Imu)? --remap /xsens:=imu",
    ]
    remaps = [("/odom", "odometry"), ("/xsens", "imu")]
    assert list(overlooked(elsewhere, select(elsewhere, remaps))) == []


def test_what_is_ours_or_another_trains_is_not_overlooked() -> None:
    own = {f"/{topic.name}": topic.type for topic in RECORDED if topic not in (POSITION, FIX, ODOMETRY)}
    assert list(overlooked(own, select(own))) == [], "the simulator's truth and results have the type of an odometry"
    both = within("/a") | within("/b", OF_A_TRAIN | {"/imu": IMU.type, "/x/imu": IMU.type}) | OF_A_TRAIN
    assert list(overlooked(both, select(both, namespace="/a"), "/a")) == []


def test_a_topic_of_another_type_under_our_name_is_to_be_left_out() -> None:
    near = OF_A_TRAIN | {"/speed": "geometry_msgs/msg/TwistStamped"}
    with pytest.raises(ValueError, match=r"speed needs .*\. Convert it, or leave it out: --remap /speed:=unused$"):
        select(near)
    assert set(select(near, [parse_remap("/speed:=unused")])) == set(OF_A_TRAIN)
    with pytest.raises(ValueError, match=r"It holds: .*--remap /radar:=speed$"):
        select(near | {"/radar": SPEED.type})

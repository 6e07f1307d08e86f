# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The quality of service that a topic's publishers offer: into a recording, and out of it again."""

from collections.abc import Sequence

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

from ..bag.qos import FOREVER
from ..wire.topic import Topic
from .ros.qos import PROFILES


def offered(node: Node, topic: Topic) -> list[Qos]:
    """What the publishers of a topic offer, each kind once; when they are gone already, what ours do."""
    ends = node.get_publishers_info_by_topic(topic.name)
    kinds = {_recorded(end.qos_profile) for end in ends} or {_recorded(PROFILES[topic.quality].publisher)}
    return sorted(kinds, key=repr)


def as_recorded(offers: Sequence[Qos], depth: int) -> QoSProfile:
    """Return the profile by which a player stands for the publishers of a recording.

    Reliable, which suits every subscriber, with the queue `depth`. Where a publisher kept its last messages for late
    subscribers, so does the player; messages expire as they did, the longest lived of them.
    """
    profile = QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE)
    if any(one.durability is QosDurability.TRANSIENT_LOCAL for one in offers):
        profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
        profile.depth = max(1, *(one.depth for one in offers))
    if expires(offers):
        longest = max(one.lifespan for one in offers)
        profile.lifespan = Duration(seconds=longest.sec, nanoseconds=longest.nsec)
    return profile


def expires(offers: Sequence[Qos]) -> bool:
    """Whether messages of all these publishers are given up after a time."""
    return bool(offers) and all(QosTime(0, 0) < one.lifespan < FOREVER for one in offers)


def _recorded(profile: QoSProfile) -> Qos:
    """A profile of rclpy in the words of a recording: both count as rmw does. DDS does not tell history and depth."""
    return Qos(
        QosHistory(int(profile.history)),
        profile.depth,
        QosReliability(int(profile.reliability)),
        QosDurability(int(profile.durability)),
        _time(profile.deadline),
        _time(profile.lifespan),
        QosLiveliness(int(profile.liveliness)),
        _time(profile.liveliness_lease_duration),
        avoid_ros_namespace_conventions=bool(profile.avoid_ros_namespace_conventions),
    )


def _time(duration: Duration) -> QosTime:
    """0 is how rmw says that nothing is limited, where it is asked for nothing."""
    return QosTime(*divmod(duration.nanoseconds, 10**9)) if duration.nanoseconds else FOREVER

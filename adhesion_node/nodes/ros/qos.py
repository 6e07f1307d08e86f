# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The profiles for the table's words on quality of service, and the two functions that open a topic by its entry."""

from collections.abc import Callable
from copy import copy
from typing import Any, NamedTuple

from rcl_interfaces.msg import SetParametersResult
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions
from rclpy.subscription import Subscription

from adhesion_node.wire.topic import Quality, Topic

from .qos_events import Tell, of_publisher, of_subscription
from .types import message_class

MAX_DEPTH = 10_000
"""Longest queue that an override may ask for: minutes of a 100 Hz sensor."""

SENSOR_SUBSCRIPTION = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Best effort, so that every publisher matches; deep, so that one slow window loses nothing."""

SENSOR_PUBLISHER = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
RESULT = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""The last message waits for subscribers that come later."""

EXPIRING = copy(LATCHED)
EXPIRING.lifespan = Duration(seconds=5.0)
"""The same, but no longer than this: who comes later than that must not get an old braking curve."""


class Ends(NamedTuple):
    """The profiles of the two ends of a topic."""

    publisher: QoSProfile
    subscription: QoSProfile


PROFILES = {
    Quality.SENSOR: Ends(SENSOR_PUBLISHER, SENSOR_SUBSCRIPTION),
    Quality.RESULT: Ends(RESULT, RESULT),
    Quality.EXPIRING: Ends(EXPIRING, LATCHED),
}


def _check(profile: QoSProfile) -> SetParametersResult:
    fits = 1 <= profile.depth <= MAX_DEPTH
    return SetParametersResult(successful=fits, reason="" if fits else f"depth = {profile.depth}")


OVERRIDES = QoSOverridingOptions(
    (
        *(QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY, QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH),
        *(QoSPolicyKind.DEADLINE, QoSPolicyKind.LIFESPAN),
        *(QoSPolicyKind.LIVELINESS, QoSPolicyKind.LIVELINESS_LEASE_DURATION),
    ),
    callback=_check,
)
"""Lets parameters such as `qos_overrides./position.subscription.reliability` change a profile at start."""

REMEDY = (
    "give reliability reliable|best_effort, durability volatile|transient_local, history keep_last|keep_all, "
    f"depth 1 to {MAX_DEPTH}, liveliness automatic|manual_by_topic, deadline, lifespan, liveliness_lease_duration in ns"
)


def subscribe(
    node: Node,
    topic: Topic,
    callback: Callable[..., None],
    profile: QoSProfile | None = None,
    *,
    raw: bool = False,
    tell: Tell | None = None,
    lost: Callable[[Any], None] | None = None,
) -> Subscription:
    """Subscribe `node` to `topic`, parameters overriding its profile; ValueError when an override is bad.

    `profile` takes the place of the one that the table gives the topic. `tell` hears of the events of DDS; without it
    rclpy logs what does not fit. `lost` hears of messages that were lost on the way.
    """
    try:
        return node.create_subscription(
            message_class(topic.type),
            topic.name,
            callback,
            # rclpy writes the overrides of this topic into the profile it is given.
            copy(profile or PROFILES[topic.quality].subscription),
            qos_overriding_options=OVERRIDES,
            raw=raw,
            event_callbacks=of_subscription(node.resolve_topic_name(topic.name), tell, lost)
            if tell
            else SubscriptionEventCallbacks(message_lost=lost),
        )
    except _BAD_OVERRIDE as error:
        raise ValueError(_refusal(node, topic, "subscription")) from error


def advertise(node: Node, topic: Topic, profile: QoSProfile | None = None, *, tell: Tell | None = None) -> Publisher:
    """Open `topic` for publishing from `node`, as `subscribe` does."""
    try:
        return node.create_publisher(
            message_class(topic.type),
            topic.name,
            copy(profile or PROFILES[topic.quality].publisher),
            qos_overriding_options=OVERRIDES,
            event_callbacks=tell and of_publisher(node.resolve_topic_name(topic.name), tell),
        )
    except _BAD_OVERRIDE as error:
        raise ValueError(_refusal(node, topic, "publisher")) from error


_BAD_OVERRIDE = (AssertionError, AttributeError, TypeError, RuntimeError, InvalidQosOverridesError, ParameterException)
"""What rclpy raises for an override of a wrong type or value."""


def _refusal(node: Node, topic: Topic, end: str) -> str:
    prefix = f"qos_overrides.{node.resolve_topic_name(topic.name)}.{end}"
    given = [node.get_parameter(name) for name in node.list_parameters([prefix], 0).names]
    values = ", ".join(f"{parameter.name.rpartition('.')[2]} = {parameter.value}" for parameter in given)
    return f"{prefix}: {values}: {REMEDY}"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What DDS notices of the other side, in words: qualities that do not fit, missed deadlines, publishers that die."""

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import qos_policy_name_from_kind

Tell = Callable[[str], None]

_MODEST = {"reliability": "best_effort", "durability": "volatile"}
"""What every publisher offers."""

_ASKED = {"deadline": ("deadline",), "liveliness": ("liveliness", "liveliness_lease_duration")}
"""What is asked for by these parameters alone: DDS does not tell which of two it is."""


def of_subscription(topic: str, tell: Tell, lost: Callable[[Any], None] | None) -> SubscriptionEventCallbacks:
    """Return the callbacks of a subscription to `topic` (its resolved name); each tells one line.

    `lost` hears of lost messages before that is told.
    """
    tell_lost = _counted(tell, f"{topic}: messages lost on the way")

    def incompatible(event: Any) -> None:
        policy, override = _policy(event), f"qos_overrides.{topic}.subscription."
        remedy = f"start this node with -p {override}{policy}:={_MODEST[policy]}" if policy in _MODEST else ""
        if policy in _ASKED:
            remedy = f"leave {' and '.join(override + name for name in _ASKED[policy])} out"
        text = f"{topic}: a publisher offers less {policy} than is asked for, so nothing of it arrives"
        tell(f"{text}: {remedy}" if remedy else text)

    def message_lost(event: Any) -> None:
        if lost is not None:
            lost(event)
        tell_lost(event)

    def liveliness(event: Any) -> None:
        if event.alive_count_change < 0:
            tell(f"{topic}: a publisher shows no life, {event.alive_count} left")

    def matched(event: Any) -> None:
        if event.current_count_change < 0:
            tell(f"{topic}: a publisher has gone, {event.current_count} left")

    return SubscriptionEventCallbacks(
        deadline=_counted(tell, f"{topic}: deadline missed"),
        incompatible_qos=incompatible,
        liveliness=liveliness,
        message_lost=message_lost,
        matched=matched,
    )


def of_publisher(topic: str, tell: Tell) -> PublisherEventCallbacks:
    """Return the callbacks of a publisher of `topic` (its resolved name); each tells one line."""

    def incompatible(event: Any) -> None:
        tell(f"{topic}: a subscriber asks for more {_policy(event)} than is offered and receives nothing")

    return PublisherEventCallbacks(
        deadline=_counted(tell, f"{topic}: own deadline missed"),
        incompatible_qos=incompatible,
        liveliness=_counted(tell, f"{topic}: own liveliness lost"),
    )


def _counted(tell: Tell, text: str) -> Callable[[Any], None]:
    """Tell the first, second, fourth, eighth ... of events that come again and again."""

    def told(event: Any) -> None:
        if event.total_count & (event.total_count - 1) == 0 or event.total_count_change > 1:
            tell(f"{text}, {event.total_count} so far")

    return told


def _policy(event: Any) -> str:
    return str(qos_policy_name_from_kind(event.last_policy_kind)).lower()

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What simulators publish, for their tests."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import pytest
from rclpy.publisher import Publisher

ROS_OWN = ("/rosout", "/parameter_events", "/diagnostics")
Sent = list[tuple[str, Any]]


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> Sent:
    """Everything published on our topics, as (absolute topic name, message), in the order of publishing."""
    record: Sent = []
    publish = Publisher.publish

    def recording(self: Publisher, message: Any) -> None:
        if self.topic_name not in ROS_OWN:
            record.append((self.topic_name, message))
        publish(self, message)

    monkeypatch.setattr(Publisher, "publish", recording)
    return record


def by_topic(sent: Sent) -> dict[str, list[Any]]:
    """Return the messages by topic."""
    lists: dict[str, list[Any]] = defaultdict(list)
    for topic, message in sent:
        lists[topic].append(message)
    return lists

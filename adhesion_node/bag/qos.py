# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The quality of service that the publishers of a topic offered: rosbag2 keeps it, so that a player offers the same."""

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2.errors import ReaderError
from rosbags.rosbag2.metadata import dump_qos_v9, parse_qos

FOREVER = QosTime(9223372036, 854775807)
"""How rosbag2 writes a duration that is not limited."""

RELIABLE = Qos(
    QosHistory.KEEP_LAST,
    100,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    deadline=FOREVER,
    lifespan=FOREVER,
    liveliness=QosLiveliness.AUTOMATIC,
    liveliness_lease_duration=FOREVER,
    avoid_ros_namespace_conventions=False,
)
"""Of a topic whose publishers are not known."""


@lru_cache  # most channels say the same, and a file says it of each at least twice
def parse(text: str) -> tuple[Qos, ...]:
    """Read the list that a channel of an MCAP file holds: by names since version 9, by numbers before.

    >>> [qos.durability.name for qos in parse(str(profiles([RELIABLE])))]
    ['VOLATILE']
    >>> parse(""), parse("- durability: 1")
    ((), ())
    """
    try:
        return tuple(parse_qos(text))
    except (ReaderError, AttributeError, LookupError, TypeError, ValueError, RecursionError):  # as good as none
        return ()


def profiles(offered: Iterable[Qos]) -> list[dict[str, Any]]:
    """Return what metadata.yaml says of them."""
    return [{**profile} for profile in dump_qos_v9(list(offered))]

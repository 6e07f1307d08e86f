# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Remappings of topics that are not there, which ROS passes over without a word."""

from collections.abc import Sequence
from itertools import pairwise

from rclpy.expand_topic_name import expand_topic_name
from rclpy.node import Node

from adhesion_node.wire.topics import TOPICS

from .params import hint

_OF_RCLPY = ("/rosout", "/parameter_events")


def misnamed(ros_arguments: Sequence[str], node: Node) -> list[str]:
    """Return one message for each topic that is remapped but that the package does not have: a typo, as a rule.

    ROS passes over it without a word. Names below the node's own are its services; a pattern may be for anything.
    """
    own, space = node.get_name(), node.get_namespace()
    names = [expand_topic_name(topic.name, own, space) for topic in TOPICS]
    told = []
    for rule in (rule for option, rule in pairwise(ros_arguments) if option in ("-r", "--remap")):
        whose, _, name = rule.partition(":=")[0].replace("rostopic://", "").rpartition(":")
        if whose not in ("", own) or name.startswith(("__", "~", "//")) or "*" in name:
            continue
        full = expand_topic_name(name, own, space)
        if full not in (*names, *_OF_RCLPY) and not full.startswith(f"{node.get_fully_qualified_name()}/"):
            told.append(f"-r {rule}: {own} has no topic {full}{hint(full, names)}")
    return told

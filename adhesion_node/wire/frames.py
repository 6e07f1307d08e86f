# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Frames and direction of the line: what counts along the run becomes what counts along the track.

The codecs write results along the run, in the frames `track` and `train`. Where the chainage falls along the run, a
train that goes forward goes against x of the track: its pose is turned by 180 degrees, and so is its braking curve. How
it moves, twist and deceleration, is said in its own frame, x forward.
"""

from typing import Any

from .line import Line


def placed(message: Any, line: Line) -> Any:
    """Put a result in the frames of the line, places as chainage; return it, changed."""
    if hasattr(message, "header"):
        forward_only = line.sign < 0 and hasattr(message, "accel")
        message.header.frame_id = line.child_frame if forward_only else line.frame
    if hasattr(message, "child_frame_id"):
        message.child_frame_id = line.child_frame
    if line.sign < 0:
        _turn(message)
    return message


def _turn(message: Any) -> None:
    if hasattr(message, "pose"):
        pose = message.pose.pose
        pose.position.x = -pose.position.x
        pose.orientation.z, pose.orientation.w = 1.0, 0.0
    for point in getattr(message, "points", ()):
        for name in ("positions", "velocities", "accelerations"):
            setattr(point, name, [-value for value in getattr(point, name)])

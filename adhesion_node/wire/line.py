# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a reader or writer knows of the line beyond the message: its frames, its direction, its air, its centre line."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ..core.setting import check_settings, setting

if TYPE_CHECKING:  # it needs a geodesy library, and that only where there is a track line
    from .track_line import TrackLine

FRAME = "track"
"""Frame of places: x is the chainage of the track."""

TRAIN = "train"
"""Moving frame of the state and joint of the braking curve."""

UP, DOWN = "up", "down"
"""The chainage rises along the run, or falls."""

ATMOSPHERE_PA = 101_325.0
"""Standard atmosphere at sea level."""

MIN_ABSOLUTE_PA, MAX_ABSOLUTE_PA = 45e3, 5e6
"""Air on the highest railway (5072 m) is 53 kPa, less in bad weather; no brake works above 5 MPa."""

MAX_AMBIENT_PA = 110e3
"""No air pressure has been seen above."""


@dataclass(frozen=True, slots=True)
class Line:
    """How the messages of a line are read and written. Raises ValueError naming what is out of range."""

    frame: str = setting(FRAME, "frame_id that positions must have and that results get", group="intake")
    ambient_pressure_pa: float = setting(
        ATMOSPHERE_PA,
        "Pressure of the air, by which an absolute brake pressure is above the gauge one; some 54 kPa at 5000 m",
        "Pa",
        MIN_ABSOLUTE_PA,
        MAX_AMBIENT_PA,
        group="intake",
    )
    position_source: str = setting(
        "auto",
        "Topic of the positions; auto: fix where there is a track_line, else position, else odometry",
        choices=("auto", "position", "fix", "odometry"),
        group="intake",
    )
    position_std_m: float = setting(
        3.0,
        "Standard deviation of a position whose message gives none (covariance 0 or of type unknown)",
        "m",
        1e-3,
        1e4,
        group="intake",
    )
    max_cross_track_m: float = setting(
        25.0, "Distance from track_line beyond which a fix is refused", "m", 0.1, 1e4, group="intake"
    )
    child_frame: str = setting(TRAIN, "Frame of the train in results: child_frame_id, x forward", group="intake")
    direction: str = setting(
        UP, "Whether the chainage rises along the run (up) or falls (down)", choices=(UP, DOWN), group="intake"
    )
    track: "TrackLine | None" = None
    """The track's centre line, on which a `fix` is projected."""
    unused: frozenset[str] = frozenset()
    """Names of the topics that are switched off."""
    latency_s: dict[str, float] = field(default_factory=dict, hash=False)
    """By how much stamps are late, by the name of the topic; what is not named is not."""

    def __post_init__(self) -> None:
        check_settings(self, "")
        if self.position_source == "fix" and self.track is None:
            raise ValueError("position_source = 'fix': set track_line, too, on which a fix is projected")

    @property
    def sign(self) -> int:
        """What a chainage is multiplied by so that it grows along the run, and the other way round."""
        return -1 if self.direction == DOWN else 1


NOMINAL = Line()

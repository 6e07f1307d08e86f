# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The health of the inputs of the live page: when the messages of each came, and why those that are refused are."""

from collections import deque
from typing import Any

from ..core.intake.outcome import text_of
from ..wire.topic import Topic
from ..wire.topics import ATP_STATUS, BRAKE_PRESSURE, BRAKING_CURVE, MU, POSITION, SPEED, STATE

EXPECTED = {
    POSITION: "position",
    BRAKE_PRESSURE: "brake pressure",
    SPEED: "odometer (optional)",
    STATE: "estimator",
    MU: "adhesion",
    BRAKING_CURVE: "braking curve",
    ATP_STATUS: "ATP monitor",
}
"""The inputs whose health is shown, in words."""

RATE_OVER_S = 3.0
"""Time over which the rate of an input is counted."""


class Inputs:
    """Notes what comes and gives its health out by parts, ready for JSON. Mutable; another thread may read it."""

    def __init__(self) -> None:
        self._arrivals: dict[Topic, deque[float]] = {topic: deque() for topic in EXPECTED}
        self._refusals: dict[Topic, str] = {}
        self._taken: dict[str, float | None] = {}  # when the last message was taken of topics now refused

    def parts(self, now_s: float) -> dict[str, Any]:
        """Return the health of each input, when it was last heard and, where it is refused, last taken."""
        return {
            "inputs": {topic.name: self._health(topic, now_s) for topic in EXPECTED},
            "heard": {name: round(at_s, 2) for name, at_s in self.last_heard().items()},
            "taken": self._taken,
        }

    def last_heard(self) -> dict[str, float]:
        """When the last message of each expected topic came, by its name; of none that is silent from the start."""
        return {topic.name: at[-1] for topic in EXPECTED if (at := tuple(self._arrivals[topic]))}

    def heard(self, topic: Topic, now_s: float, refusal: str) -> bool:
        """A message of a topic has come; whether it is refused, as the one before was not."""
        arrivals = self._arrivals.setdefault(topic, deque())
        arrivals.append(now_s)
        while arrivals[0] < now_s - RATE_OVER_S:
            arrivals.popleft()
        is_news = bool(refusal) and not self._refusals.get(topic)
        self._refusals[topic] = text_of(refusal)
        if not refusal:
            self._taken = {name: at_s for name, at_s in self._taken.items() if name != topic.name}
        elif topic.name not in self._taken:
            before_s = round(arrivals[-2], 2) if len(arrivals) > 1 else None
            self._taken = {**self._taken, topic.name: before_s}
        return is_news

    def _health(self, topic: Topic, now_s: float) -> dict[str, Any]:
        arrivals, refusal = tuple(self._arrivals[topic]), self._refusals.get(topic, "")
        state = "never" if not arrivals else "refused" if refusal else "heard"
        # A message of 3 s ago has only left the window when the next one comes.
        recent = sum(arrival > now_s - RATE_OVER_S for arrival in arrivals)
        return {"name": EXPECTED[topic], "state": state, "hz": round(recent / RATE_OVER_S, 1), "why": refusal}

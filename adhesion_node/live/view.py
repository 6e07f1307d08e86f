# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What the live page shows at present, kept from the messages as they come: plain values, no ROS and no clock.

The parts are replaced as a whole and never changed in place, so that another thread may read them at any time.
"""

import math
from collections import deque
from collections.abc import Mapping
from typing import Any

from ..core.atp.received import StampedCurve, TrainState
from ..core.physics.train import KMH
from ..wire.topics import ATP_STATUS, BRAKE_PRESSURE, BRAKING_CURVE, POSITION, SPEED, STATE, Topic

EXPECTED = {
    POSITION: "position",
    BRAKE_PRESSURE: "brake pressure",
    SPEED: "odometer (optional)",
    STATE: "estimator",
    BRAKING_CURVE: "braking curve",
    ATP_STATUS: "ATP monitor",
}
"""The inputs whose health is shown, in words."""

RATE_OVER_S = 3.0
"""Time over which the rate of an input is counted."""

LATE_S = 2.0
"""Age from which an input counts as late; the ATP monitor uses a curve no longer either."""

MOST_POINTS = 600
"""Points of a history."""

SPACING_S, SPACING_M = 0.5, 20.0
"""Least distance between two points of a history: over time, and along the track."""

LIMITS = ("permitted", "warning", "sbi", "ebi", "indication")
"""Speeds of the supervision; in its status `permitted_mps` and so on."""


class View:
    """Takes what the messages say and gives it out by parts, ready for JSON. Mutable."""

    def __init__(self) -> None:
        self._parts: dict[str, Any] = {}
        self._arrivals: dict[Topic, deque[float]] = {topic: deque() for topic in EXPECTED}
        self._refusals: dict[Topic, str] = {}
        self._ended_s: float | None = None
        self._start_ns = self._newest_ns = 0
        self._mu: dict[str, float] = {}
        self._clear()

    def parts(self, now_s: float) -> dict[str, Any]:
        """Return the present parts by name; None or empty while unknown. `now_s` is a time as given to `heard`."""
        now_s = now_s if self._ended_s is None else self._ended_s
        inputs = [self._health(topic, now_s) for topic in EXPECTED]
        return {**self._parts, "inputs": inputs, "ended": self._ended_s is not None}

    def heard(self, topic: Topic, now_s: float, refusal: str = "") -> None:
        """A message of a topic has come; `refusal` says why it cannot be shown."""
        arrivals = self._arrivals.setdefault(topic, deque())
        arrivals.append(now_s)
        while arrivals[0] < now_s - RATE_OVER_S:
            arrivals.popleft()
        self._refusals[topic] = refusal

    def place(self, position_m: float) -> None:
        """A measured position."""
        self._parts["place_m"] = round(position_m, 1)

    def train(self, state: TrainState) -> None:
        """An estimated state. A stamp before the last one begins a new run."""
        if state.t_ns < self._newest_ns or not self._start_ns:
            self._clear()
            self._start_ns = state.t_ns
        self._newest_ns = state.t_ns
        self._parts["train"] = {
            "t": round((state.t_ns - self._start_ns) * 1e-9, 2),
            "position": round(state.position_m, 1),
            "speed": round(state.speed_mps / KMH, 2),
        }

    def adhesion(self, name: str, value: float) -> None:
        """An adhesion: `mu`, `mu_lower` or, of a simulator, `true_mu`."""
        self._mu[name] = round(value, 5)

    def estimated(self, values: Mapping[str, str], message: str) -> None:
        """The estimator's diagnostics, which end the messages of an estimate."""
        regime = values.get("regime", "")
        self._parts["estimator"] = {
            "message": message,
            "regime": regime,
            "confidence": values.get("confidence", ""),
            "dropped": {key.removeprefix("dropped."): n for key, n in values.items() if key.startswith("dropped.")},
            **{key: values[key] for key in ("measurements", "accepted", "windows") if key in values},
        }
        train = self._parts["train"]
        if train is not None and {"mu", "mu_lower"} <= self._mu.keys():
            self._parts["adhesion"] = dict(self._mu)
            self._append("history", "t", SPACING_S, {**train, "regime": regime.lower(), **self._mu})

    def curve(self, name: str, placed: StampedCurve) -> None:
        """A braking curve, `safe` or `nominal`."""
        way = {"x": placed.places_m.round(1).tolist(), "y": (placed.curve.speed_mps / KMH).round(2).tolist()}
        self._parts["curves"] = {**self._parts["curves"], name: way}

    def supervised(self, values: Mapping[str, str], message: str) -> None:
        """The status of the ATP monitor; its limits are None where it knows none."""
        numbers = {key: number for key, text in values.items() if (number := _number(text)) is not None}
        kmh = {
            key.removesuffix("_mps"): round(number / KMH, 2) for key, number in numbers.items() if key.endswith("_mps")
        }
        limits = {name: kmh.get(name) for name in LIMITS}
        target_m, left_m = numbers.get("target_position_m"), numbers.get("distance_to_target_m")
        self._parts["supervision"] = {
            "level": values.get("level", ""),
            "message": message,
            "target_m": target_m,
            "target_kmh": kmh.get("target_speed"),
            "left_m": left_m,
            "margin_m": numbers.get("margin_m"),
            **limits,
        }
        if target_m is not None and left_m is not None:
            self._append("passed", "position", SPACING_M, {"position": round(target_m - left_m, 1), **limits})

    def end(self, now_s: float) -> None:
        """The run has ended: what is shown stays as it is at this time."""
        self._ended_s = now_s

    def _clear(self) -> None:
        """Forget the last run; the adhesions stay, as those of an estimate come before its state."""
        unknown = dict.fromkeys(("place_m", "train", "adhesion", "estimator", "supervision"))
        self._parts = {**unknown, "curves": {}, "history": (), "passed": ()}

    def _append(self, name: str, key: str, spacing: float, row: dict[str, Any]) -> None:
        history = self._parts[name]
        if not history or abs(row[key] - history[-1][key]) >= spacing:
            self._parts[name] = (*history, row)[-MOST_POINTS:]

    def _health(self, topic: Topic, now_s: float) -> dict[str, Any]:
        arrivals, refusal = tuple(self._arrivals[topic]), self._refusals.get(topic, "")
        said = {"name": EXPECTED[topic], "topic": topic.name}
        if not arrivals:
            return {**said, "state": "never", "hz": 0.0, "age": None}
        age = now_s - arrivals[-1]
        state = "refused" if refusal else "late" if age > LATE_S else "good"
        # A message of 3 s ago has only left the window when the next one comes.
        recent = sum(arrival > now_s - RATE_OVER_S for arrival in arrivals)
        return {**said, "state": state, "hz": round(recent / RATE_OVER_S, 1), "age": round(age, 1), "why": refusal}


def _number(text: str) -> float | None:
    """Read a number; None for a text or what is not finite.

    >>> _number("2.5"), _number("NORMAL"), _number("nan")
    (2.5, None, None)
    """
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None

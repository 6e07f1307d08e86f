# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the live page shows at present, kept from the messages as they come: plain values, no ROS and no clock.

The parts are replaced as a whole and never changed in place, so that another thread may read them at any time.
"""

from collections.abc import Mapping
from itertools import islice
from typing import Any, NamedTuple

from ..core.atp.received import StampedCurve, TrainState
from ..core.intake.outcome import text_of
from ..core.physics.braking import BrakingCurve
from ..core.physics.train import KMH
from ..report.ahead import SHOWN, ahead
from ..report.found.regimes import IN_WORDS
from ..run.results.known import kind_of
from ..web.creep import creep_part
from ..web.fit import number, numbers, rounded
from ..wire.topic import Topic
from .inputs import Inputs

MOST_POINTS, MOST_EVENTS = 600, 60
"""Rows of a history, and of the events."""

SPACING_S, SPACING_M = 0.5, 20.0
"""Least distance between two points of a history: over time, and along the track."""

CURVE_POINTS, MOST_KEYS = 24, 100
"""Points of a curve, and entries of a status that are looked at."""

COUNTS = ("measurements", "accepted", "windows", "changes", "resets")
"""What is told of the estimator's diagnostics."""

BRAKES = ("SERVICE_BRAKE", "EMERGENCY_BRAKE")
"""Levels at which the monitor brakes."""


class Rows(NamedTuple):
    """The newest rows of a history, and how many have gone before them."""

    gone: int = 0
    rows: tuple[Any, ...] = ()

    def with_row(self, row: Any, most: int) -> "Rows":
        """Append a row; of more than `most` the oldest goes."""
        surplus = max(len(self.rows) + 1 - most, 0)
        return Rows(self.gone + surplus, (*self.rows, row)[surplus:])


class View:
    """Takes what the messages say and gives it out by parts, ready for JSON. Mutable."""

    def __init__(self) -> None:
        self._inputs = Inputs()
        self._ended_s: float | None = None
        self._start_ns = self._newest_ns = self._run = 0
        self._mu: dict[str, float] = {}
        self._safe: BrakingCurve | None = None
        self._sign = 1
        self._clear()

    def parts(self, now_s: float) -> dict[str, Any]:
        """Return the present parts by name; None or empty while unknown. `now_s` is a time as given to `heard`.

        Places count along the run: `sign` is -1 where the chainage falls.
        """
        now_s = now_s if self._ended_s is None else self._ended_s
        return {
            **self._parts,
            "run": self._run,
            "sign": self._sign,
            "now": round(now_s, 2),
            **self._inputs.parts(now_s),
            "ended": self._ended_s is not None,
        }

    def last_heard(self) -> dict[str, float]:
        """When the last message of each expected topic came, by its name; of none that is silent from the start."""
        return self._inputs.last_heard()

    def heard(self, topic: Topic, now_s: float, refusal: str = "") -> None:
        """A message of a topic has come; `refusal` says why it cannot be shown."""
        if self._inputs.heard(topic, now_s, refusal):
            self._event("fault", f"{topic.name} refused: {text_of(refusal)}")

    def place(self, position_m: float) -> None:
        """A measured position."""
        self._parts["place_m"] = number(self._sign * position_m, 1)

    def train(self, state: TrainState) -> None:
        """An estimated state. A stamp before the last one begins a new run."""
        if state.t_ns < self._newest_ns or not self._start_ns:
            self._clear()
            self._start_ns = state.t_ns
        self._newest_ns = state.t_ns
        self._parts["train"] = {
            "t": round((state.t_ns - self._start_ns) * 1e-9, 2),
            "position": number(self._sign * state.position_m, 1),
            "speed": number(abs(state.speed_mps) / KMH, 2),
        }
        self._awaited = True

    def adhesion(self, name: str, value: float) -> None:
        """An adhesion: `mu`, `mu_lower` or, of a simulator, `true_mu`."""
        if (fit := number(value, 5)) is not None:
            self._mu[name] = fit

    def estimated(self, values: Mapping[str, str], message: str, alarming: bool = False) -> None:
        """The estimator's diagnostics, which end the messages of an estimate and may come between two."""
        values = {text_of(key): text_of(value) for key, value in islice(values.items(), MOST_KEYS)}
        before, regime = self._parts["estimator"] or {}, values.get("regime", "")
        counts: dict[str, Any] = {key: values[key] for key in COUNTS if key in values}
        self._parts["estimator"] = now = {
            "message": text_of(message),
            "alarming": alarming,
            "regime": regime.lower(),
            "words": IN_WORDS.get(regime, "not known yet"),
            "confidence": values.get("confidence", ""),
            "dropped": {key.removeprefix("dropped."): n for key, n in values.items() if key.startswith("dropped.")},
            **counts,
        }
        for key, said in (("changes", "the rail has changed"), ("resets", "the estimator began anew")):
            if before and (number(now.get(key), 0) or 0) > (number(before.get(key), 0) or 0):
                self._event(key.removesuffix("s"), said)
        if regime != before.get("regime", "").upper():
            self._event("regime", now["words"])
        if alarming and message != before.get("message"):
            self._event("fault", now["message"])
        if self._parts["train"] is not None and self._awaited:
            found: dict[str, Any] | None = None
            if {"mu", "mu_lower"} <= self._mu.keys():
                found = {**self._mu, "kind": kind_of(self._mu["mu"], self._mu["mu_lower"], regime)}
            self._parts["adhesion"] = found
            row = {**self._parts["train"], "regime": regime.lower(), **(found or self._mu)}
            self._append("history", "t", SPACING_S, row)
            # What is withheld is not published: the next estimate must not be shown with this one's numbers.
            self._mu = {name: value for name, value in self._mu.items() if name == "true_mu"}
            self._awaited = False

    def creep(self, values: Mapping[str, str], message: str, now_s: float) -> None:
        """The creep estimator's diagnostics, at the time `now_s`."""
        if (part := creep_part(values, message)) is not None:
            self._parts["creep"] = part | {"heard": round(now_s, 2)}

    def curve(self, name: str, placed: StampedCurve) -> None:
        """A braking curve, `safe` or `nominal`, which tells in which direction places are met."""
        if placed.sign != self._sign:
            self._sign = placed.sign
            self._clear()
        kept = slice(None, None, max(len(placed.places_m) // CURVE_POINTS, 1))
        columns = (placed.places_m * placed.sign, placed.curve.speed_mps / KMH)
        places, speeds = ([*row[kept], row[-1]] for row in columns)
        self._parts["curves"] = {**self._parts["curves"], name: {"x": rounded(places, 0), "y": rounded(speeds, 1)}}
        if name == "safe":
            self._safe = placed.curve

    def supervised(self, values: Mapping[str, str], message: str) -> None:
        """The status of the ATP monitor; its limits are None where it knows none."""
        known = numbers(values)
        if "target_position_m" in known:
            known["target_position_m"] *= self._sign
        kmh = {key.removesuffix("_mps"): number(value / KMH, 1) for key, value in known.items() if key.endswith("_mps")}
        target_m, left_m = known.get("target_position_m"), known.get("distance_to_target_m")
        limits = None if self._safe is None else ahead(self._safe, known)
        level, before = text_of(values.get("level", "")), self._parts["supervision"] or {}
        self._parts["supervision"] = {
            "level": level,
            "message": text_of(message),
            "target_m": number(target_m, 1),
            "target_kmh": kmh.get("target_speed"),
            "left_m": number(left_m, 1),
            "margin_m": number(known.get("margin_m"), 0),
            "to_indication_s": None if limits is None else number(limits.to_indication_s, 1),
            **{name: kmh.get(name) for name in (*SHOWN, "indication")},
        }
        self._parts["ahead"] = None
        if limits is not None:
            rows = {name: rounded(row / KMH, 1) for name, row in zip(SHOWN, limits[1:5], strict=True)}
            self._parts["ahead"] = {"x": rounded(limits.position_m, 0), **rows}
        if level != before.get("level"):
            self._event("intervention" if level in BRAKES else "level", level.replace("_", " "))
        if target_m is not None and left_m is not None:
            place = {"position": number(target_m - left_m, 1), **{name: kmh.get(name) for name in SHOWN}}
            self._append("passed", "position", SPACING_M, place)

    def end(self, now_s: float) -> None:
        """The run has ended: what is shown stays as it is at this time."""
        self._ended_s = now_s

    def _clear(self) -> None:
        """Forget the last run; the adhesions stay, as those of an estimate come before its state."""
        unknown = dict.fromkeys(("place_m", "train", "adhesion", "estimator", "supervision", "ahead", "creep"))
        self._parts: dict[str, Any] = {**unknown, "curves": {}, "history": Rows(), "passed": Rows(), "events": Rows()}
        self._run += 1
        self._awaited = False
        self._safe = None

    def _event(self, kind: str, said: str) -> None:
        at_s = 0.0 if self._parts["train"] is None else self._parts["train"]["t"]
        row = {"t": at_s, "kind": kind, "text": said}
        self._parts["events"] = self._parts["events"].with_row(row, MOST_EVENTS)

    def _append(self, name: str, key: str, spacing: float, row: dict[str, Any]) -> None:
        history = self._parts[name]
        if row[key] is not None and (not history.rows or abs(row[key] - history.rows[-1][key]) >= spacing):
            self._parts[name] = history.with_row(row, MOST_POINTS)

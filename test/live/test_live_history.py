# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the live page keeps of a run: histories, events, a new run; and that the news add up to the whole."""

from __future__ import annotations

import json
from typing import Any

from told_view import STATUS, S, estimate

from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.physics.braking import curve
from adhesion_node.core.physics.train import CRH3
from adhesion_node.live.feed import Feed
from adhesion_node.live.view import MOST_POINTS, View
from adhesion_node.wire.topics import ATP_STATUS, BRAKE_PRESSURE, BRAKING_CURVE, MU, POSITION, SPEED, STATE


def test_stamps_that_go_back_begin_a_new_run() -> None:
    view = View()
    for second in (0, 1, 2):
        estimate(view, second)
    view.supervised(STATUS, "brake")
    estimate(view, 0)  # a recording that is played again
    assert [row["t"] for row in view.parts(0.0)["history"].rows] == [0.0]
    assert view.parts(0.0)["passed"].rows == ()


def test_histories_are_bounded() -> None:
    view = View()
    for second in range(MOST_POINTS + 5):
        estimate(view, second)
        view.supervised(STATUS | {"distance_to_target_m": str(6000.0 - 80.0 * second)}, "brake")
    parts = view.parts(0.0)
    assert (len(parts["history"].rows), parts["history"].rows[-1]["t"]) == (MOST_POINTS, MOST_POINTS + 4.0)
    assert len(parts["passed"].rows) == MOST_POINTS
    assert (parts["history"].gone, len(parts["events"].rows)) == (5, 2)


def test_a_quick_estimator_fills_a_history_no_faster() -> None:
    view = View()
    for tenth in range(31):
        view.adhesion("mu", 0.08)
        view.adhesion("mu_lower", 0.07)
        view.train(TrainState(S + tenth * S // 10, 5.0 * tenth, 50.0))
        view.supervised(STATUS | {"distance_to_target_m": str(6000.0 - 5.0 * tenth)}, "brake")
        view.estimated({"regime": "COASTING"}, "")
    assert [row["t"] for row in view.parts(0.0)["history"].rows] == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert [row["position"] for row in view.parts(0.0)["passed"].rows] == [20.0 * k for k in range(8)]


def test_what_was_given_out_does_not_change() -> None:
    view = View()
    estimate(view, 0)
    before = view.parts(0.0)
    text = repr(before)
    estimate(view, 1, mu=0.1)
    assert repr(before) == text


def test_at_the_end_the_ages_stand_still() -> None:
    view = View()
    view.heard(POSITION, 10.0)
    view.end(10.5)
    parts = view.parts(60.0)
    assert parts["ended"] is True
    assert (parts["now"], parts["heard"]) == (10.5, {"position": 10.0})


def test_events_are_told_once_each() -> None:
    view = View()
    for second, (regime, changes, resets) in enumerate(
        [("COASTING", 0, 0), ("BRAKE_LIMITED", 0, 0), ("BRAKE_LIMITED", 1, 1)]
    ):
        view.train(TrainState(1000 * S + second * S, 80.0 * second, 80.0))
        view.estimated({"regime": regime, "changes": str(changes), "resets": str(resets)}, "well")
    for _ in range(3):
        view.heard(SPEED, 1.0, "speed = nan")
        view.supervised(STATUS, "brake")
    view.supervised(STATUS | {"level": "EMERGENCY_BRAKE"}, "brake")
    told = [(row["t"], row["kind"], row["text"]) for row in view.parts(0.0)["events"].rows]
    assert told == [
        (0.0, "regime", "nothing is claimed"),
        (1.0, "regime", "the brake limits"),
        (2.0, "change", "the rail has changed"),
        (2.0, "reset", "the estimator began anew"),
        (2.0, "fault", "speed refused: speed = nan"),
        (2.0, "level", "OVERSPEED"),
        (2.0, "intervention", "EMERGENCY BRAKE"),
    ]


def viewers_parts(messages: list[str]) -> dict[str, Any]:
    """What the messages add up to."""
    parts: dict[str, Any] = {}
    for message in map(json.loads, messages):
        parts |= message.get("all", {}) | message.get("set", {}) | {"now": message["now"]}
        parts |= {name: parts[name] | entries for name, entries in message.get("change", {}).items()}
        parts |= {name: (parts[name] + rows)[-MOST_POINTS:] for name, rows in message.get("add", {}).items()}
    return parts


def test_the_news_add_up_to_the_whole_and_are_short() -> None:
    """Twenty minutes at 10 Hz with 2 estimates a second; before, the whole history went with every one of them."""
    view, clock, lengths = View(), [0.0], []
    feed = Feed(lambda: view.parts(clock[0]))
    messages = [feed.whole()]
    braking = curve(CRH3, 60.0, 0.07)
    for tick in range(12_000):
        clock[0] = 0.1 * tick
        for topic in (POSITION, BRAKE_PRESSURE, SPEED):
            view.heard(topic, clock[0])
        view.place(8.0 * tick)
        if tick % 5 == 0:
            view.adhesion("true_mu", 0.09)
            for topic in (MU, STATE, BRAKING_CURVE, ATP_STATUS):
                view.heard(topic, clock[0])
            for name in ("safe", "nominal"):
                view.curve(name, StampedCurve(0, 8.0 * tick, braking))
            estimate(view, tick // 5, mu=0.07 + 1e-5 * (tick % 1000))
            view.supervised(STATUS | {"distance_to_target_m": f"{1e5 - 8.0 * tick:.3f}"}, "brake")
        messages.append(feed.news())
        lengths.append(len(messages[-1]))
    clock[0] += 1.0
    messages.append(feed.news())
    assert viewers_parts(messages) == json.loads(Feed(lambda: view.parts(clock[0])).whole())["all"]
    assert sum(lengths[-600:]) / 60.0 < 5000.0, "bytes a second"

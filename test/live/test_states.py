# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Every state of the live page as a picture: what it says, in which colours, and that all of it can be read."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest
import seen
from pages import Line, browser, line
from told_view import S, estimate

from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.physics.braking import curve
from adhesion_node.core.physics.train import CRH3, KMH

pytestmark = pytest.mark.usefixtures("chromium")


class Level(NamedTuple):
    """A level of the monitor, a speed at which it holds, and its colours: box, hub and letters of the speed."""

    name: str
    kmh: int
    box: tuple[int, int, int]
    hub: tuple[int, int, int]


GREY, YELLOW, ORANGE, RED = (195, 195, 195), (223, 223, 0), (234, 145, 0), (191, 0, 2)
NIGHT, UNKNOWN = (3, 17, 34), (85, 85, 85)
LEVELS = (
    Level("NORMAL", 160, (36, 51, 74), GREY),
    Level("INDICATION", 175, YELLOW, YELLOW),
    Level("OVERSPEED", 182, NIGHT, ORANGE),
    Level("WARNING", 185, ORANGE, ORANGE),
    Level("SERVICE_BRAKE", 190, RED, RED),
    Level("EMERGENCY_BRAKE", 200, RED, RED),
)
"""Permitted are 180 km/h; warned is from 184, braked from 187, by the emergency brake from 194."""

REGIMES = {
    "COASTING": ("nothing is claimed", "μ̂ 0.0800, at least 0.0750 (95 %)"),
    "BRAKE_LIMITED": ("the brake limits", "μ ≥ 0.0800, which the brake uses; at least 0.0750 (95 %)"),
    "ADHESION_LIMITED": ("the adhesion limits", "identified μ̂ 0.0800, at least 0.0750 (95 %)"),
}
"""What is said of each."""


class Watched:
    """A line that a test drives second by second, and pictures of its page."""

    def __init__(self, shown: Line, name: str) -> None:
        self.shown, self.page, self.name = shown, shown.page, name
        self.second = 0

    def run(self, level: Level, regime: str = "ADHESION_LIMITED", seconds: int = 3) -> None:
        """Some more seconds in a regime, then a level with its speed."""
        view, braking = self.shown.view, curve(CRH3, level.kmh * KMH, 0.09)
        for _ in range(seconds):
            estimate(view, self.second, regime=regime)
            self.second += 1
        place_m = 80.0 * self.second
        view.train(TrainState(1000 * S + self.second * S, place_m, level.kmh * KMH))
        view.place(place_m)
        view.curve("safe", StampedCurve(0, place_m, braking))
        view.curve("nominal", StampedCurve(0, place_m, curve(CRH3, level.kmh * KMH, 0.1)))
        self.shown.level(level.name, target_position_m=place_m + 900.0, distance_to_target_m=900.0)
        self.shown.wait(f"{level.name.replace('_', ' ')}: ")
        self.page.locator("#dial .digits", has_text=str(level.kmh)).wait_for()

    def look(self) -> Any:
        """A picture in which all can be read."""
        browser.turn(self.page, self.name)
        picture = seen.look(self.page)
        seen.assert_readable(picture)
        return picture

    @property
    def coloured(self) -> bool:
        """Whether the page chooses its colours."""
        return "forced" not in self.name


@pytest.fixture(params=browser.LOOKS)
def watched(request: pytest.FixtureRequest) -> Iterator[Watched]:
    with line(**browser.LOOKS[request.param], device_scale_factor=2) as shown:
        yield Watched(shown, request.param)


def test_before_anything_is_heard_nothing_is_said_of_the_train(watched: Watched) -> None:
    picture = watched.look()
    for text in ("waiting for the estimator", "NO SUPERVISION yet", "Adhesion: not known", "nothing is known of μ yet"):
        assert picture.has(text), text
    assert not picture.has("km/h in")
    if watched.coloured:
        assert picture.at(watched.page, "#level", 0.985, 0.5) == UNKNOWN


def test_every_level_is_told_by_its_words_its_speed_and_its_colours(watched: Watched) -> None:
    for level in LEVELS:
        watched.run(level)
        picture = watched.look()
        told = level.name.replace("_", " ")
        assert picture.has(f"{told}: {'below all limits' if level.name == 'NORMAL' else level.name.lower()}")
        for text in (str(level.kmh), "100 km/h in 900 m", "180 km/h", "184 km/h", "187 km/h", "194 km/h"):
            assert picture.has(text), text
        assert not any(picture.has(f"{other.name.replace('_', ' ')}: ") for other in LEVELS if other is not level)
        if watched.coloured:
            assert picture.at(watched.page, "#level", 0.985, 0.5) == level.box, level
            assert picture.at(watched.page, "#dial circle", 0.5, 0.15) == level.hub, level
    if watched.name == "print":
        pages = re.findall(rb"/Type\s*/Page\b(?!s)", watched.page.pdf(format="A4"))
        assert 1 <= len(pages) <= 2
        assert re.search(r"printed 20\d\d-\d\d-\d\d \d\d:\d\d", watched.shown.says("header"))


def test_every_regime_is_told_by_its_words_and_its_band(watched: Watched) -> None:
    for regime, (words, told) in REGIMES.items():
        watched.run(LEVELS[0], regime, 40)
        watched.shown.wait(told)
        picture = watched.look()
        assert picture.has(f"Adhesion: {words}")
        assert picture.has(told)
        assert sum(picture.has(f"Adhesion: {other}") for other, _ in REGIMES.values()) == 1
        if watched.coloured:
            asked = watched.page.evaluate("(regime) => ink(`band ${regime}`)", regime.lower())
            band = tuple(int(share) for share in re.findall(r"\d+", asked))
            assert picture.at(watched.page, "#adhesion .u-over", 0.997, 0.03) == band


def test_what_is_old_is_not_in_the_picture(watched: Watched) -> None:
    watched.run(LEVELS[3])
    watched.shown.now_s = 5.0
    watched.shown.wait("NO SUPERVISION for 5 s")
    picture = watched.look()
    for text in ("estimator silent for 5 s", "Adhesion: not known", "the last value is 5 s old", "Estimator: silent"):
        assert picture.has(text), text
    for text in ("184 km/h", "WARNING: ", "identified μ̂ 0.0800", "all is well", "– in", "good"):
        assert not picture.has(text), text
    assert watched.shown.says("#dial .digits") == "–"
    if watched.coloured:
        assert picture.at(watched.page, "#level", 0.985, 0.5) == UNKNOWN
        assert picture.at(watched.page, "#dial circle", 0.5, 0.15) == GREY


def test_no_data_is_large_and_without_a_colour(watched: Watched) -> None:
    watched.run(LEVELS[5])
    watched.shown.served.close()
    watched.shown.pass_until("NO DATA since")
    picture = watched.look()
    (banner,) = [each for each in picture.texts if each.text.startswith("NO DATA since")][:1]
    assert banner.px >= 20.0
    assert banner.bottom <= 400.0, "in sight without scrolling"
    for text in ("EMERGENCY BRAKE: ", "194 km/h", "identified μ̂ 0.0800", "all is well", "good", "– in"):
        assert not picture.has(text), text
    assert watched.shown.says("#dial .digits") == "–"
    if watched.coloured:
        assert (picture.picture.max(axis=-1) - picture.picture.min(axis=-1)).max() <= 16, "all is grey"

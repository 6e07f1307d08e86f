# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The live page in a real browser: what it says of adhesion, limits, events and creep, and in which colours."""

from __future__ import annotations

import pytest
from pages import line
from told_view import S, estimate

from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.atp.supervision import read
from adhesion_node.core.physics.braking import curve
from adhesion_node.core.physics.train import CRH3
from adhesion_node.wire.topics import POSITION, SPEED

pytestmark = pytest.mark.usefixtures("chromium")


@pytest.mark.parametrize(
    ("regime", "mu_lower", "kind", "said"),
    [
        ("ADHESION_LIMITED", 0.0895, "identified", "identified μ̂ 0.0945, at least 0.0895 (95 %)"),
        ("BRAKE_LIMITED", 0.0895, "atleast", "μ ≥ 0.0945, which the brake uses; at least 0.0895 (95 %)"),
        ("COASTING", 0.0895, "known", "μ̂ 0.0945, at least 0.0895 (95 %)"),
        ("COASTING", 0.0200, "prior", "not identified; prior 0.0945, not claimed; at least 0.0200 (95 %)"),
    ],
)
def test_only_what_is_identified_is_called_so(regime: str, mu_lower: float, kind: str, said: str) -> None:
    """A brake-limited adhesion of 0.0945 was labelled identified while the true one was 0.239, off the scale."""
    with line() as shown:
        shown.view.adhesion("true_mu", 0.239)
        for second in (0, 1, 2):
            estimate(shown.view, second, mu=0.0945, regime=regime, mu_lower=mu_lower)
        shown.hear()
        shown.wait(said)
        drawn = {
            name: shown.page.evaluate(
                "(label) => course.plot.data[course.plot.series.findIndex((s) => s.label.startsWith(label))]"
                ".filter((y) => y != null)",
                label,
            )
            for name, label in (("identified", "identified"), ("atleast", "≥"), ("known", "known"), ("prior", "prior"))
        }
        assert drawn == {name: [0.0945] * 3 if name == kind else [] for name in drawn}
        assert shown.page.evaluate("course.plot.scales.y.max") >= 0.239
        assert shown.page.locator("#gauge .at.truth").evaluate("(at) => parseFloat(at.style.left)") < 99.0
        right = shown.page.evaluate(  # in one call, as the page draws the gauge anew meanwhile
            "(kind) => { const span = document.querySelector(`#gauge .span.${kind}`);"
            " return span.getBoundingClientRect().right - span.parentElement.getBoundingClientRect().right }",
            kind,
        )
        assert (abs(right) < 2.0) is (kind == "atleast"), "open above only where the brake limits"


@pytest.mark.parametrize(
    ("level", "pointer", "digits", "text"),
    [
        ("NORMAL", "rgb(195, 195, 195)", "rgb(0, 0, 0)", "NORMAL: below all limits"),
        ("INDICATION", "rgb(223, 223, 0)", "rgb(0, 0, 0)", "INDICATION: indication"),
        ("OVERSPEED", "rgb(234, 145, 0)", "rgb(0, 0, 0)", "OVERSPEED: overspeed"),
        ("WARNING", "rgb(234, 145, 0)", "rgb(0, 0, 0)", "WARNING: warning"),
        ("SERVICE_BRAKE", "rgb(191, 0, 2)", "rgb(255, 255, 255)", "SERVICE BRAKE: service_brake"),
        ("EMERGENCY_BRAKE", "rgb(191, 0, 2)", "rgb(255, 255, 255)", "EMERGENCY BRAKE: emergency_brake"),
    ],
)
def test_every_level_has_its_colour(level: str, pointer: str, digits: str, text: str) -> None:
    with line() as shown:
        estimate(shown.view, 0)
        shown.view.place(2500.0)
        shown.level(level)
        shown.wait(text)
        fills = [
            shown.page.locator(where).evaluate("(part) => getComputedStyle(part).fill")
            for where in ("#dial circle", "#dial .digits")
        ]
        assert fills == [pointer, digits]
        looks = shown.page.locator("#level").evaluate("(box) => getComputedStyle(box).backgroundColor + box.className")
        others = shown.page.evaluate(
            "(own) => ['normal', 'indication', 'overspeed', 'warning', 'service_brake'].filter((name) => name !== own)"
            ".map((name) => { const box = document.getElementById('level'), was = box.className;"
            " box.className = `level ${name}`; const look = getComputedStyle(box).backgroundColor;"
            " box.className = was; return look + was; })",
            level.lower(),
        )
        assert level.endswith("_BRAKE") or looks not in others, "a level looks like another one"
        assert (shown.page.locator("#dial .bar").count() == 1) is (level != "NORMAL"), "the target bar"


def test_limits_ahead_and_the_time_to_the_indication() -> None:
    with line() as shown:
        config, braking = SupervisionConfig(), curve(CRH3, 80.0, 0.09)
        state = TrainState(1000 * S, 1500.0, 80.0, 0.5, 0.1)
        reading = read(config, braking, state, 1000 * S)
        estimate(shown.view, 0)
        shown.view.place(1500.0)
        shown.view.curve("safe", StampedCurve(0, 1500.0, braking))
        numbers = {"target_position_m": 6000.0, "target_speed_mps": config.target_speed_mps, **reading._asdict()}
        shown.level("NORMAL", **numbers)
        shown.wait("100 km/h in 4500 m")
        ends = shown.page.evaluate(
            "way.plot.series.slice(1, 5).map((series, i) =>"
            " [series.label, way.plot.data[i + 1].findLast((y) => y != null)])"
        )
        assert [label for label, _ in ends] == ["permitted", "warning", "service brake", "emergency brake"]
        assert dict(ends)["permitted"] == pytest.approx(100.0, abs=0.1)
        assert dict(ends)["emergency brake"] == pytest.approx(107.5, abs=0.1)
        soon = shown.page.locator("#limits tr", has_text="indication in").locator("td").nth(1).inner_text()
        indicated_s = shown.view.parts(0.0)["supervision"]["to_indication_s"]
        assert indicated_s > 1.0
        assert soon == f"{indicated_s:.0f} s"


def test_a_target_that_is_passed_is_said_so() -> None:
    with line() as shown:
        estimate(shown.view, 0)
        shown.view.place(9322.0)
        shown.level("NORMAL", distance_to_target_m=-3322.0)
        shown.wait("100 km/h, passed")
        assert "-3322" not in shown.says("body")


def test_events_are_listed_and_marked() -> None:
    with line() as shown:
        estimate(shown.view, 0, regime="COASTING")
        estimate(shown.view, 4)
        shown.view.heard(SPEED, 0.0, "speed = nan")
        shown.level("EMERGENCY_BRAKE")
        shown.wait("4 s: EMERGENCY BRAKE")
        assert shown.page.locator("#events li").all_inner_texts() == [
            "4 s: EMERGENCY BRAKE",
            "4 s: speed refused: speed = nan",
            "4 s: the adhesion limits",
            "0 s: nothing is claimed",
        ]


def test_the_creep_curve_its_peak_and_what_is_withheld() -> None:
    known = {
        "p1": "80",
        "p2": "100",
        "mu_max": "0.2",
        "lambda_m": "0.1",
        "mu_max_lower": "0.18",
        "mu_max_upper": "0.22",
    }
    with line() as shown:
        assert not shown.page.locator("#creep").is_visible()
        shown.view.creep(known | {"withheld": "true"}, "withheld: the data do not reach the peak", 0.0)
        shown.wait("withheld: the data do not reach the peak")
        assert shown.page.evaluate("slip.plot.series[1].label") == "prior, withheld"
        shown.view.creep(known | {"withheld": "false"}, "known", 0.0)
        shown.wait("peak 0.200 at a creep of 0.100, 0.180 to 0.220")
        assert shown.page.evaluate("slip.plot.series[1].label") == "identified"
        shown.now_s = 4.0
        shown.hear(POSITION)
        shown.wait("nothing from the creep estimator for 4 s")
        assert shown.page.evaluate("slip.plot.data[1].every((y) => y == null)")

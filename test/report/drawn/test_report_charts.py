# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The charts of a report in a real browser: what they show, and what they name."""

from __future__ import annotations

import pytest
import seen
from reports import an_hour, shown_range, two_runs

browser = pytest.importorskip("browser", reason="playwright, of the extra `test`, is not installed")


pytestmark = pytest.mark.usefixtures("chromium")


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> str:
    return two_runs(tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module")
def hour(tmp_path_factory: pytest.TempPathFactory) -> str:
    return an_hour(tmp_path_factory.mktemp("hour"))


def test_a_band_has_its_own_name(hour: str) -> None:
    """Before: the name stood left of its band, or half of it was cut off, as the axes aligned their numbers."""
    with browser.open_page() as (page, _):
        page.goto(hour)
        page.get_by_role("button", name="600.0 s", exact=True).click()
        page.wait_for_function("() => [...drawn][2].plot.scales.x.min === 595")
        bands, written = page.evaluate(
            """() => {
              const { plot } = [...drawn][2], { ctx } = plot, { fillText } = ctx, written = [];
              ctx.fillText = (text, x, y) => {
                const { actualBoundingBoxLeft: left, actualBoundingBoxRight: right } = ctx.measureText(text);
                written.push([text, x - left, x + right]);
                fillText.call(ctx, text, x, y);
              };
              plot.batch(() => plot.redraw());
              const at = (x) => plot.valToPos(x, "x", true);
              return [runs[0].bands.map(({ from, to, label }) => [label, at(from), at(to)]), written];
            }"""
        )
        names = {label for label, *_ in bands}
        drawn = [each for each in written if each[0] in names]
        assert drawn
        for name, left, right in drawn:
            assert any(name == label and from_ <= left and right <= to for label, from_, to in bands), name


def test_the_marks_of_a_legend_follow_the_scheme(hour: str) -> None:
    """Before: in the colours that the page was opened in, pale on paper."""
    with browser.open_page() as (page, _):
        page.goto(hour)
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            page.wait_for_function(
                """() => inks.clear() || [...drawn].every(({ plot: { root, series } }) => {
                  const marks = [...root.closest(".chart").querySelectorAll(".u-marker")].slice(1);
                  return marks.every((mark, i) => getComputedStyle(mark).borderTopColor === series[i + 1].stroke());
                })"""
            )


def test_a_legend_has_values_under_the_pointer_alone(hour: str) -> None:
    """Before: "permitted: –" beside a permitted speed, as the pointer was elsewhere."""
    with browser.open_page() as (page, _):
        page.goto(f"{hour}#t=610")
        legend = page.locator("figure.chart").nth(1).locator(".u-legend")
        resting = legend.inner_text()
        assert "identified" in resting
        assert "–" not in resting
        assert "time" not in resting
        page.locator(".u-over").nth(1).hover()
        page.wait_for_function("(was) => document.querySelectorAll('.u-legend')[1].innerText !== was", arg=resting)
        assert "time, s" in legend.inner_text()


def test_the_numbers_of_an_axis_are_whole(hour: str) -> None:
    """Before: of 10,000 m the first figure was cut off."""
    with browser.open_page() as (page, _):
        page.goto(hour)
        for size, longest in page.evaluate(
            "[...drawn].filter((made) => made.plot).map(({ plot }) => [plot.axes[1]._size,"
            " Math.max(...plot.axes[1]._values.map((text) => {"
            " plot.ctx.font = plot.axes[1].font[0]; return plot.ctx.measureText(text).width / uPlot.pxRatio; }))])"
        ):
            assert size >= longest + 15.0, "ticks and their gap take 15 pixels"


def test_no_line_bridges_where_it_does_not_hold(hour: str) -> None:
    """Before: a prior went on, dotted, through what was identified, as other lines have values within its gap."""
    with browser.open_page() as (page, _):
        page.goto(hour)
        page.evaluate(
            """() => {
              const made = [...drawn][1], dense = Array.from({ length: 201 }, (_, i) => i / 10);
              made.draw({ title: "gap", x: { label: "time, s", range: [0, 20] }, y: { range: [0, 2] }, lines: [
                { label: "dense", kind: "truth", x: dense, y: dense.map(() => 0.2) },
                { label: "with a gap", kind: "sbi", x: [0, 4, 8, 12, 16, 20], y: [1, 1, null, null, 1, 1] }] });
            }"""
        )
        page.wait_for_function("[...drawn][1].plot.scales.x.max === 20")
        ends = page.evaluate("[0, 4, 15].map((x) => [...drawn][1].plot.valToPos(x, 'x'))")
        over = page.locator(".u-over").nth(1).bounding_box()
        picture, yellow = seen.look(page), (138, 109, 0)
        inside, outside = (
            picture.part((over["x"] + from_, over["y"], over["x"] + to, over["y"] + over["height"]))
            for from_, to in ((ends[1] + 5.0, ends[2]), (ends[0], ends[1]))
        )
        assert (outside == yellow).all(axis=-1).sum() > 20
        assert not (inside == yellow).all(axis=-1).any()


def test_the_curves_are_shown_to_where_the_braking_ended(report: str) -> None:
    """Before: on a rail worse than the worst case the chart ended before the train did."""
    with browser.open_page() as (page, _):
        page.goto(f"{report}#t=12")
        assert shown_range(page, 0)[1] >= page.evaluate("runs[0].moments.at(-1).place")


def test_gaps_are_gaps(hour: str) -> None:
    with browser.open_page() as (page, _):
        page.goto(hour)
        between = page.evaluate(
            "(() => { const u = [...drawn][2].plot, k = u.series.findIndex((s) => s.label === 'estimated');"
            " return u.data[0].map((x, i) => [x, u.data[k][i]]).filter(([x, y]) => y === null).length; })()"
        )
        assert between == 6


@pytest.mark.parametrize("language", ["de-DE", "C"])
def test_numbers_are_written_alike_whatever_the_browser_speaks(hour: str, language: str) -> None:
    """Before: "0,05" along an axis and "0.05" below it, and no chart at all in a WebKitGTK without a language."""
    with browser.open_page() as (page, _):
        page.add_init_script(f"Object.defineProperty(Navigator.prototype, 'language', {{ get: () => '{language}' }})")
        page.goto(hour)
        page.wait_for_function("() => drawn.size > 1")
        written = page.evaluate(
            """() => {
              const written = [];
              for (const { plot } of drawn) {
                const { ctx } = plot, { fillText } = ctx;
                ctx.fillText = (text, ...where) => { written.push(text); fillText.call(ctx, text, ...where); };
                plot.batch(() => plot.redraw());
              }
              return written;
            }"""
        )
        decimals = [text for text in written if text.startswith("0") and len(text) > 1]
        assert decimals
        assert all(text.startswith("0.") for text in decimals)

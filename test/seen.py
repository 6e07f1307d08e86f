# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a picture of a page shows: its colours, and whether each of its texts can be read there."""

from __future__ import annotations

from io import BytesIO
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Picture = NDArray[np.uint8]
"""Pixels: rows, columns, (red, green, blue)."""

LEAST_CONTRAST, LEAST_OF_LARGE, LARGE_PX, LARGE_BOLD_PX = 4.5, 3.0, 24.0, 18.66
"""WCAG 2.2, 1.4.3: of a text, and of one from a height on."""

OVERLAP_PX = 2.0
"""Lines of text may touch by so much."""

TRIES = 10
"""Photographs at most, until a page is not drawn meanwhile."""

TEXTS = """() => {
  const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode, host = node.parentElement, range = document.createRange();
    if (!node.data.trim() || !host.checkVisibility({ visibilityProperty: true }) ||
        host.closest("script, style, noscript, select, title, .unseen")) continue;
    range.selectNodeContents(node);
    const style = getComputedStyle(host), bold = Number(style.fontWeight) >= 700;
    for (let box of host instanceof SVGElement ? [host.getBoundingClientRect()] : range.getClientRects()) {
      let hidden = box.width < 1;
      for (let around = host.parentElement; around; around = around.parentElement) {
        const { overflowX, overflowY } = getComputedStyle(around), edge = around.getBoundingClientRect();
        if (overflowX !== "visible") hidden ||= box.right > edge.right + 1 || box.left < edge.left - 1;
        if (overflowY !== "visible") hidden ||= box.bottom > edge.bottom + 1 || box.top < edge.top - 1;
      }
      if (!hidden) found.push({ text: node.data.trim(), left: box.left + scrollX, top: box.top + scrollY,
                                right: box.right + scrollX, bottom: box.bottom + scrollY,
                                px: parseFloat(style.fontSize), bold });
    }
  }
  return found;
}"""
"""Every line of text that is drawn: what can be scrolled to, inside a part of the page, is not."""


class Text(NamedTuple):
    """A line of text and the box that it fills, CSS pixels from the page's corner."""

    text: str
    left: float
    top: float
    right: float
    bottom: float
    px: float
    bold: bool

    @property
    def least_contrast(self) -> float:
        """What WCAG asks of a text of this size."""
        return LEAST_OF_LARGE if self.px >= (LARGE_BOLD_PX if self.bold else LARGE_PX) else LEAST_CONTRAST


class Seen(NamedTuple):
    """A picture of a whole page, the pixels of the screen for one of CSS, and the texts in it."""

    picture: Picture
    scale: float
    width: float
    texts: tuple[Text, ...]

    def part(self, box: Any) -> Picture:
        """What a box (left, top, right, bottom) shows."""
        left, top, right, bottom = (round(edge * self.scale) for edge in box)
        return self.picture[max(top, 0) : bottom, max(left, 0) : right]

    def at(self, page: Any, where: str, right: float, down: float) -> tuple[int, ...]:
        """Colour at a place within an element: shares of its width and height."""
        box = page.locator(where).bounding_box()
        row, column = box["y"] + down * box["height"], box["x"] + right * box["width"]
        return tuple(self.picture[round(row * self.scale), round(column * self.scale)].tolist())

    def has(self, text: str) -> bool:
        """Whether a text stands in the picture."""
        return any(text in each.text for each in self.texts)


def look(page: Any) -> Seen:
    """Photograph a page as a whole. Where it is drawn meanwhile, again: its texts and pixels are of one moment."""
    before = page.evaluate(TEXTS)
    for _ in range(TRIES):
        photograph = page.screenshot(full_page=True, animations="disabled", caret="hide")
        texts, before = before, page.evaluate(TEXTS)
        if texts == before:
            break
    width, scale = page.evaluate("[innerWidth, devicePixelRatio]")
    drawn = np.asarray(Image.open(BytesIO(photograph)).convert("RGB"))
    return Seen(drawn, scale, width, tuple(Text(**each) for each in texts))


def luminance(colours: Any) -> Any:
    """Relative luminance of WCAG, of colours (..., 3) of 0 to 255.

    >>> luminance([255, 255, 255]).round(3).item()
    1.0
    """
    shares = np.asarray(colours) / 255.0
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return linear @ np.array([0.2126, 0.7152, 0.0722])


def packed(part: Picture) -> NDArray[np.int64]:
    """The colour of each pixel as one number."""
    return np.asarray(part.reshape(-1, 3).astype(np.int64) @ np.array([1 << 16, 1 << 8, 1]))


def contrast(part: Picture) -> float:
    """Contrast of the letters in a box: its commonest colour against the one that differs most."""
    colours, counts = np.unique(packed(part), return_counts=True)
    shades = luminance(np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=-1))
    light, paper = shades, shades[counts.argmax()]
    high, low = np.maximum(light, paper), np.minimum(light, paper)
    return float(((high + 0.05) / (low + 0.05)).max())


def assert_readable(seen: Seen) -> None:
    """Every text is within the page's width, stands out from what is behind it, and lies on no other one."""
    assert np.unique(packed(seen.picture[::3, ::3])).size > 10, "a blank page"
    for each in seen.texts:
        assert each.left >= 0.0, each
        assert each.right <= seen.width + 1.0, f"cut off: {each}"
        found = contrast(seen.part(each[1:5]))
        assert found >= each.least_contrast, f"contrast {found:.2f}: {each}"
    rows = sorted(seen.texts, key=lambda each: each.top)
    for index, upper in enumerate(rows):
        for lower in rows[index + 1 :]:
            if lower.top >= upper.bottom - OVERLAP_PX:
                break
            overlap = min(upper.right, lower.right) - max(upper.left, lower.left)
            assert overlap <= OVERLAP_PX, f"{upper.text!r} lies on {lower.text!r}"

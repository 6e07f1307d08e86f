// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// The report of many brakings: adhesion over place, of a date or of all, that the buttons of the tables choose.

const { lines, track, highest, low } = JSON.parse(document.getElementById("data").textContent);
const date = document.getElementById("date"), view = shared(), rail = chart(document.getElementById("place"), { view });
const LABELS = { identified: "identified", atleast: "at least: what was used", bound: "lower bound" };

function show() {
  const { x, ...found } = lines[date.value], title = date.selectedIndex === 0 ? "lowest of all dates" : date.value;
  rail.draw({ title: `Adhesion over place, ${title}`, x: { label: "place, km", range: track }, y: { range: [0, highest] },
              lines: [{ label: `low: below ${low}`, kind: "fixed", x: track, y: [low, low] }, ...Object.entries(LABELS).map(([kind, label]) => ({ label, kind, x, y: found[kind] }))] });
}

date.addEventListener("change", show);
for (const button of document.querySelectorAll("button[data-from]")) {
  button.addEventListener("click", () => {
    const [from, to] = [Number(button.dataset.from), Number(button.dataset.to)];
    if (button.dataset.date in lines) date.value = button.dataset.date; else date.selectedIndex = 0;
    show();
    view.show(Math.max(from - 0.5, track[0]), Math.min(to + 0.5, track[1]));
    document.getElementById("place").scrollIntoView();
  });
}
show();

// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// The report: a column of charts for every run, and one slider that moves the present through all of them.

const { runs, target_kmh: target, fixed_mu: fixedMu } = JSON.parse(document.getElementById("data").textContent);
const slider = document.getElementById("slider"), shownTime = document.getElementById("time");
const all = (pick) => runs.flatMap(pick);
const longest = Math.max(...all((run) => run.moments.at(-1).t), ...all((run) => run.charts.flatMap((spec) => spec.lines.map((line) => line.x.at(-1)))));

// Equal axes in all columns: runs side by side are to be compared by eye.
const common = (i) => ({ range: [Math.min(...all((run) => run.charts[i].range[0])), Math.max(...all((run) => run.charts[i].range[1]))] });
const time = { label: "time, s", range: [0, longest] };
// A bound near 0 needs any distance: as far as the fixed worst case tells all there is to compare.
const way = { label: "position from the start, m", range: [0, 1.08 * Math.max(1, ...all((run) => run.path.x), ...all((run) => run.moments.map((m) => m.fixed.x.at(-1))))] };

function curveChart(run, moment) {
  const lines = [{ label: `by the fixed ${fixedMu}`, kind: "fixed", ...moment.fixed }, { label: "what the train did", kind: "truth", ...run.path }];
  if (moment.safe) lines.push({ label: "safe: by the lower bound", kind: "bound", ...moment.safe });
  if (moment.nominal) lines.push({ label: "by the identified μ̂", kind: "nominal", ...moment.nominal });
  return { title: "Braking curve at this time, km/h", x: way, y: common(1), lines,
           marks: [{ x: moment.fixed.x[0], y: moment.fixed.y[0], kind: "run", label: "" }] };
}

const number = (value, digits, unit = "") => (value === null ? "–" : value.toFixed(digits) + unit);

function readout(moment) {
  return `${number(moment.speed, 1)} km/h, μ̂ ${number(moment.mu, 4)}, at least ${number(moment.mu_lower, 4)}, ${moment.regime}; ` +
    `to ${target} km/h ${number(moment.distance, 0)} m, saved ${number(moment.saved, 0)} m, at least ${number(moment.saved_at_least, 0)} m`;
}

// The newest moment at a time; the first one before it.
const momentAt = (run, t) => run.moments.findLast((moment) => moment.t <= t) ?? run.moments[0];

const view = shared();
const columns = runs.map((run) => {
  const host = document.getElementById("runs").appendChild(element("section", { class: "run" }));
  host.append(element("h2", {}, run.name), element("p", { class: "soft" }, run.source));
  const text = host.appendChild(element("p", { class: "readout" })), grid = host.appendChild(element("div", { class: "columns" }));
  const curve = chart(grid), charts = run.charts.map((spec, i) => {
    const made = chart(grid, { view, onPick: show });
    made.draw({ ...spec, x: time, y: common(i), bands: run.bands });
    return made;
  });
  return (t) => {
    const moment = momentAt(run, t);
    text.textContent = readout(moment);
    charts.forEach((made) => made.cursor(Math.min(t, longest)));
    curve.draw(curveChart(run, moment));
  };
});

function show(t) {
  const shown = Math.min(Math.max(t, 0), longest);
  slider.value = String(shown);
  shownTime.textContent = `${shown.toFixed(0)} s`;
  columns.forEach((update) => update(shown));
}

slider.max = String(Math.ceil(longest));
slider.addEventListener("input", () => show(Number(slider.value)));
// The report opens where adhesion is first identified; #t=42 in the address opens another time.
const asked = /t=([\d.]+)/.exec(location.hash);
show(asked ? Number(asked[1]) : Math.min(...runs.map((run) => run.opens_at)));

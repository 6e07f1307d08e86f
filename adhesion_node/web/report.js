// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// The report: a column of charts for every run, and one present that slider, charts, rows of brakings and the address move.

const { runs, target_kmh: target, fixed_mu: fixedMu } = JSON.parse(document.getElementById("data").textContent);
const ADDRESS_MS = 200;
const slider = document.getElementById("slider"), shownTime = document.getElementById("time");
const LIMITS = { permitted: "permitted", warning: "warning", sbi: "service brake", ebi: "emergency brake" };
const all = (pick) => runs.flatMap(pick), highest = (values) => values.reduce((high, value) => Math.max(high, value), 1);
const longest = highest([...all((run) => run.moments.at(-1).t), ...all((run) => run.charts.flatMap((spec) => spec.lines.map((line) => line.x.at(-1))))]);

// Equal axes in all columns: runs side by side are to be compared by eye.
const common = (i) => ({ range: [Math.min(...all((run) => run.charts[i].range[0])), Math.max(...all((run) => run.charts[i].range[1]))] });
const time = { label: "time, s", range: [0, longest] };
const number = (value, digits, unit = "") => (value === null ? "–" : value.toFixed(digits) + unit);

// The newest of some at a time; the first one before it.
function newest(each, t) {
  let low = 0, high = each.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (each[middle].t <= t) low = middle; else high = middle;
  }
  return each[low];
}
const momentAt = (run, t) => newest(run.moments, t);

// The fixed worst case from a speed on: a part of its one curve from the highest.
function fixedFrom(run, { place, speed }) {
  const { x, y } = run.fixed, first = Math.max(y.findIndex((each) => each < speed), 1), from = (speed - y[first]) / (y[first - 1] - y[first] || 1);
  const start = x[first] - from * (x[first] - x[first - 1]);
  return { x: [place, ...x.slice(first).map((each) => each - start + place)], y: [speed, ...y.slice(first)] };
}

// Where the braking of a time, or the way after it, is: to where it ended and as far as the fixed worst case tells.
function extentAt(run, t) {
  const [from, end] = run.brakings.findLast(([start]) => start <= t) ?? run.brakings[0] ?? [0, 0], first = momentAt(run, Math.max(from, t < from ? t : from));
  return [first.place, Math.max(fixedFrom(run, first).x.at(-1), momentAt(run, end).place)];
}

function curveChart(run, moment, wide) {
  const lines = Object.entries(moment.limits === null ? {} : LIMITS).map(([kind, label]) => ({ label, kind, x: moment.limits.x, y: moment.limits[kind] }));
  lines.push({ label: `by the fixed ${fixedMu}`, kind: "fixed", ...fixedFrom(run, moment) }, { label: "what the train did", kind: "truth", ...run.path });
  if (moment.safe) lines.push({ label: "safe curve", kind: "bound", ...moment.safe });
  if (moment.nominal) lines.push({ label: "nominal curve, by μ̂", kind: "nominal", ...moment.nominal });
  const from = extentAt(run, moment.t)[0] - 0.05 * wide;
  return { title: "Braking curves and limits at this time, km/h", x: { label: "position from the start, m", range: [from, from + 1.15 * wide] }, y: common(1), lines,
           marks: [{ x: moment.place, y: moment.speed, kind: "run", label: "" }] };
}

const MU = { identified: "identified μ̂", atleast: "μ ≥", known: "μ̂", prior: "not identified; prior" };
const told = ({ kind, mu }) => (mu === null ? "nothing is known of μ" : `${MU[kind]} ${mu.toFixed(4)}`);

function readout(moment) {
  const saved = moment.saved_at_least, kept = saved >= 0 ? `saved at least ${number(saved, 0)} m` : `${number(-saved, 0)} m more than the fixed`;
  const claim = moment.kind === "prior" || saved === null ? "" : `, ${kept}`;
  return `${number(moment.speed, 1)} km/h, ${told(moment)}, at least ${number(moment.mu_lower, 4)}, ${moment.words}; ` +
    `to ${target} km/h by μ̂ ${number(moment.distance, 0)} m, by the safe curve ${number(moment.longest, 0)} m${claim}`;
}

const view = shared(() => { [slider.min, slider.max] = view.zoom ?? [0, longest]; }), sections = document.getElementById("runs");
const columns = runs.map((run) => {
  const host = sections.appendChild(element("section", { class: "run", "aria-label": run.name }));
  host.append(element("h2", {}, run.name), element("p", { class: "soft" }, run.source));
  const text = document.getElementById("readouts").appendChild(element("p", { class: "readout" })), grid = host.appendChild(element("div", { class: "columns" }));
  const curve = chart(grid), charts = run.charts.map((spec, i) => {
    const made = chart(grid, { view, onPick: show });
    made.draw({ ...spec, x: time, y: common(i), bands: run.bands, events: i ? [] : run.events });
    return made;
  });
  const slip = run.creep.length > 0 ? chart(grid) : null, about = slip && host.appendChild(element("p", { class: "creep" }));
  return (t, wide) => {
    const moment = momentAt(run, t);
    text.textContent = (runs.length > 1 ? `${run.name}: ` : "") + readout(moment);
    charts.forEach((made) => made.cursor(t));
    curve.draw(curveChart(run, moment, wide));
    if (slip === null) return;
    const creep = newest(run.creep, t), none = creep.t > t;
    drawCreepCurve(slip, creep, none);
    about.textContent = none ? "Creep curve: no estimate yet" : `Creep curve at ${creep.t.toFixed(1)} s: ${creepText(creep)}`;
  };
});

function show(t) {
  const shown = Math.min(Math.max(t, 0), longest), wide = highest(runs.map((run) => extentAt(run, shown)).map(([from, to]) => to - from));
  slider.value = String(shown);
  shownTime.textContent = `${shown.toFixed(1)} s`;
  columns.forEach((update) => update(shown, wide));
  address(`#t=${Number(shown.toFixed(1))}`);
}

// The address follows a moving slider five times a second: Safari refuses more than ten.
let told_ms = -ADDRESS_MS, later;
function address(hash) {
  const tell = () => { told_ms = performance.now(); history.replaceState(null, "", hash); }, wait_ms = told_ms + ADDRESS_MS - performance.now();
  clearTimeout(later);
  if (wait_ms <= 0) tell(); else later = setTimeout(tell, wait_ms);
}

const asked = () => /t=([\d.]+)/.exec(location.hash)?.[1];
slider.max = String(longest);
slider.addEventListener("input", () => show(Number(slider.value)));
addEventListener("hashchange", () => asked() && show(Number(asked())));
for (const button of document.querySelectorAll("button[data-from]")) {
  button.addEventListener("click", () => {
    const [from, to] = [Number(button.dataset.from), Number(button.dataset.to)];
    view.show(Math.max(from - 5, 0), Math.min(to + 5, longest));
    show(from);
    document.getElementById("run").scrollIntoView();
  });
}
// The report opens where adhesion is first identified; #t=42 in the address opens another time.
show(asked() ? Number(asked()) : Math.min(...runs.map((run) => run.opens_at)));

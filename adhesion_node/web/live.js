// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// The live page: a stream of events brings what has changed, and only what hangs on it is drawn anew.

const FIXED_MU = 0.0726, GAUGE_END = 0.2, SHOWN_S = 180, BEHIND_M = 1500;
const IN_WORDS = { coasting: "nothing to learn", brake_limited: "the brake limits", adhesion_limited: "the adhesion limits" };
const byId = (id) => document.getElementById(id);
const state = { history: [], passed: [], curves: {}, inputs: [], train: null, adhesion: null, supervision: null, estimator: null, place_m: null, ended: false };
const drawDial = dial(byId("dial")), way = chart(byId("way")), course = chart(byId("adhesion"));
const number = (value, digits, unit = "") => (value === null || value === undefined ? "–" : value.toFixed(digits) + unit);

function rows(table, cells) {
  table.replaceChildren(...cells.map((texts) => {
    const row = element("tr");
    row.append(...texts.map((cell) => (cell instanceof Node ? cell : element("td", {}, cell))));
    return row;
  }));
}

function drawCab() {
  const limits = state.supervision, level = byId("level");
  drawDial(state.train?.speed ?? null, limits);
  if (limits === null) return;
  level.className = `level ${limits.level.toLowerCase()}`;
  level.textContent = `${limits.level.replaceAll("_", " ")}: ${limits.message}`;
  const left = state.place_m === null || limits.target_m === null ? null : limits.target_m - state.place_m;
  rows(byId("limits"), [
    ["target", `${number(limits.target_kmh, 0, " km/h")} in ${number(left, 0, " m")}`], ["permitted speed", number(limits.permitted, 0, " km/h")],
    ["warning from", number(limits.warning, 0, " km/h")], ["service brake from", number(limits.sbi, 0, " km/h")],
    ["emergency brake from", number(limits.ebi, 0, " km/h")], ["emergency brake in", number(limits.margin_m, 0, " m")]]);
}

function drawWay() {
  const { train, curves, passed, history, supervision } = state;
  if (train === null) return;
  const here = state.place_m ?? train.position, along = (name) => passed.map((row) => row[name]), positions = passed.map((row) => row.position);
  const ends = [here + 1000, supervision?.target_m ?? 0, curves.nominal?.x.at(-1) ?? 0], top = Math.max(train.speed, ...passed.map((row) => row.ebi ?? 0), ...history.map((row) => row.speed));
  const lines = [{ label: "emergency brake from", kind: "intervention", x: positions, y: along("ebi") }, { label: "permitted", kind: "permitted", x: positions, y: along("permitted") },
    { label: "run", kind: "truth", x: history.map((row) => row.position), y: history.map((row) => row.speed) }];
  if (curves.safe) lines.push({ label: "braking by the lower bound", kind: "bound", ...curves.safe });
  if (curves.nominal) lines.push({ label: "braking by μ̂", kind: "identified", ...curves.nominal });
  const marks = [{ x: here, y: train.speed, kind: "now", label: "" }];
  if (supervision?.target_m != null) marks.push({ x: supervision.target_m, y: supervision.target_kmh, kind: "target", label: `target ${number(supervision.target_kmh, 0)} km/h` });
  way.draw({ title: "Speed along the track, km/h", x: { label: "position, m", range: [here - BEHIND_M, Math.max(...ends) + 1000] }, y: { range: [0, 1.08 * top] }, lines, marks });
}

// Each regime holds since the estimate before; equal neighbours are one band.
function bandsOf(history) {
  const bands = [];
  history.forEach((row, i) => {
    const last = bands.at(-1), from = i ? history[i - 1].t : row.t;
    if (last?.kind === row.regime) last.to = row.t;
    else bands.push({ from, to: row.t, kind: row.regime, label: IN_WORDS[row.regime] ?? "" });
  });
  return bands;
}

function drawAdhesion() {
  const { adhesion, estimator, history } = state;
  byId("regime").textContent = `Adhesion: ${IN_WORDS[estimator?.regime.toLowerCase()] ?? "not known yet"}`;
  byId("estimator").textContent = estimator === null ? "" : `Estimator: ${estimator.message}. ${estimator.accepted ?? 0} of ${estimator.measurements ?? 0} positions used, ` +
    `${estimator.windows ?? 0} windows; not used: ${Object.entries(estimator.dropped).map(([why, count]) => `${count} ${why}`).join(", ") || "none"}.`;
  if (adhesion === null) return;
  const share = (value) => `${(100 * Math.min(Math.max(value / GAUGE_END, 0), 1)).toFixed(2)}%`, gauge = byId("gauge");
  const mark = (value, kind, label) => element("span", { class: `at ${kind}`, style: `left:${share(value)}`, title: `${label} ${value}` });
  const numbers = [0, 0.05, 0.1, 0.15, 0.2].map((value) => element("span", { class: "number", style: `left:${share(value)}` }, String(value)));
  const low = Math.min(adhesion.mu_lower, adhesion.mu), known = "true_mu" in adhesion ? [mark(adhesion.true_mu, "truth", "true")] : [];
  gauge.replaceChildren(element("span", { class: "scale" }), element("span", { class: "span", style: `left:${share(low)};width:calc(${share(adhesion.mu)} - ${share(low)})` }),
    mark(FIXED_MU, "fixed", "fixed worst case"), ...known, mark(adhesion.mu_lower, "bound", "at least"), mark(adhesion.mu, "identified", "identified"), ...numbers);
  const confidence = estimator?.confidence ? `, ${Number(estimator.confidence) * 100} %` : "", t = history.map((row) => row.t), end = Math.max(t.at(-1) ?? 0, 30);
  const column = (name) => history.map((row) => row[name] ?? null), from = Math.max(end - SHOWN_S, 0), lines = [
    { label: `fixed worst case ${FIXED_MU}`, kind: "fixed", x: [from, end], y: [FIXED_MU, FIXED_MU] }, { label: `at least ${number(adhesion.mu_lower, 4)}${confidence}`, kind: "bound", x: t, y: column("mu_lower") },
    { label: `identified μ̂ ${number(adhesion.mu, 4)}`, kind: "identified", x: t, y: column("mu"), dots: true }];
  if (known.length) lines.splice(1, 0, { label: `true ${number(adhesion.true_mu, 4)}`, kind: "truth", x: t, y: column("true_mu") });
  course.draw({ title: "", x: { label: "time, s", range: [from, end] }, y: { range: [0, GAUGE_END] }, lines, bands: bandsOf(history) });
}

function drawInputs() {
  rows(byId("inputs"), state.inputs.map((input) => [
    input.name, element("td", {}, input.topic), element("td", { class: input.state }, input.state), number(input.hz, 1, " Hz"), number(input.age, 1, " s ago"), input.why ?? ""]));
}

function drawState(connected) {
  const seconds = state.train === null ? "waiting for the estimator" : `${state.train.t.toFixed(0)} s`;
  byId("state").textContent = !connected ? "connection lost: is the program still running?" : state.ended ? `${seconds}, the run has ended` : seconds;
}

const DRAWN_BY = [[drawCab, ["train", "supervision", "place_m"]], [drawWay, ["train", "curves", "passed", "place_m"]],
  [drawAdhesion, ["adhesion", "estimator", "history"]], [drawInputs, ["inputs"]]];
const events = new EventSource("events");
events.addEventListener("message", (event) => {
  const news = JSON.parse(event.data);
  Object.assign(state, news);
  for (const [draw, names] of DRAWN_BY) if (names.some((name) => name in news)) draw();
  drawState(true);
});
events.addEventListener("error", () => drawState(false));
drawCab();

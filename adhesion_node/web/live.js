// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// The live page. A socket brings what has changed. Every value is shown as long as it is fresh: what is old is blank, and
// without a sign of life from the program the whole page is.

const FIXED_MU = 0.0726, SHOWN_S = 180, BEHIND_M = 1500, STALE_S = 2, SILENT_S = 1, RETRY_MS = 1000, EVENTS_SHOWN = 14, GAP_S = 5;
const STATE = "adhesion/state", MU = "adhesion/mu", CURVE = "adhesion/braking_curve", STATUS = "atp/status", POSITION = "position";
const LIMITS = { permitted: "permitted", warning: "warning", sbi: "service brake", ebi: "emergency brake" };
// What μ̂ is, and its line.
const KINDS = { prior: "prior", known: "known, nothing claimed", atleast: "≥, the brake limits", identified: "identified μ̂" };
const byId = (id) => document.getElementById(id);
const drawDial = dial(byId("dial")), way = chart(byId("way")), course = chart(byId("adhesion")), slip = chart(byId("creep-chart"));
const number = (value, digits, unit = "") => (value === null || value === undefined ? "–" : value.toFixed(digits) + unit);
const seconds = () => performance.now() / 1000;
const nothing = () => ({ taken: {}, heard: {}, inputs: {}, history: [], passed: [], events: [], curves: {}, ended: false });
let state = nothing(), ahead_s = null, heard_s = seconds(), heardAt = new Date(), dirty = true;

const silent = () => seconds() - heard_s > SILENT_S;
// A run that has ended stays as it is, a program that has gone does not.
const now_s = () => (state.ended && !silent() ? state.now : seconds() + ahead_s);
const since = (time) => (time == null ? Infinity : Math.max(now_s() - time, 0));
// Of what is shown, a refused message is no news.
const age = (topic) => since(topic in state.taken ? state.taken[topic] : state.heard[topic]);
const fresh = (topic, value) => (!silent() && age(topic) <= STALE_S ? value ?? null : null);
const forFor = (topic) => (age(topic) === Infinity ? "yet" : `for ${age(topic).toFixed(0)} s`);
// Text is only put where it differs: else a reader's place in it would be lost.
const say = (id, text) => { if (byId(id).textContent !== text) byId(id).textContent = text; };

function rows(table, cells) {
  table.replaceChildren(...cells.map((texts) => {
    const row = element("tr");
    row.append(...texts.map((cell) => (cell instanceof Node ? cell : element("td", {}, cell))));
    return row;
  }));
}

function levelOf(limits) {
  if (silent()) return ["none", "NO DATA"];
  if (limits === null) return ["none", `NO SUPERVISION ${forFor(STATUS)}`];
  return [limits.level.toLowerCase(), `${limits.level.replaceAll("_", " ")}: ${limits.level === "NORMAL" ? "below all limits" : limits.message}`];
}

function drawCab() {
  const limits = fresh(STATUS, state.supervision), train = fresh(STATE, state.train), [kind, text] = levelOf(limits);
  const place = fresh(POSITION, state.place_m) ?? train?.position ?? null;
  const left = place === null || limits?.target_m == null ? null : limits.target_m - place;
  drawDial(train?.speed ?? null, limits, left);
  byId("level").className = `level ${kind}`;
  say("level", text);
  const soon = limits?.level === "NORMAL" && limits.to_indication_s > 0 ? limits.to_indication_s : null;
  rows(byId("limits"), [
    ["target", number(limits?.target_kmh, 0, " km/h") + (left === null ? "" : left < 0 ? ", passed" : ` in ${left.toFixed(0)} m`)],
    ["indication in", number(soon, 0, " s")], ["permitted speed", number(limits?.permitted, 0, " km/h")],
    ["warning from", number(limits?.warning, 0, " km/h")], ["service brake from", number(limits?.sbi, 0, " km/h")],
    ["emergency brake from", number(limits?.ebi, 0, " km/h")], ["emergency brake in", number(limits?.margin_m, 0, " m")]]);
}

// Columns of rows whose `key` rises; what follows after a gap begins anew.
function columns(list, key, names, gap = Infinity) {
  const x = [], ys = names.map(() => []);
  for (const row of list) {
    if (x.length && row[key] <= x.at(-1)) continue;
    if (x.length && row[key] - x.at(-1) > gap) { x.push((x.at(-1) + row[key]) / 2); ys.forEach((y) => y.push(null)); }
    x.push(row[key]);
    ys.forEach((y, i) => y.push(row[names[i]] ?? null));
  }
  return [x, ...ys];
}

function drawWay() {
  const train = fresh(STATE, state.train), curves = fresh(CURVE, state.curves) ?? {}, limits = fresh(STATUS, state.supervision);
  const ahead = limits === null ? null : state.ahead, here = fresh(POSITION, state.place_m) ?? train?.position ?? state.history.at(-1)?.position ?? 0;
  const [passed, ...past] = columns(state.passed.filter((row) => row.position < (ahead?.x[0] ?? Infinity)), "position", Object.keys(LIMITS));
  const lines = Object.entries(LIMITS).map(([name, label], i) => ({ label, kind: name, x: [...passed, ...(ahead?.x ?? [])], y: [...past[i], ...(ahead?.[name] ?? [])] }));
  const [x, speed] = columns(state.history, "position", ["speed"]);
  lines.push({ label: "run", kind: "run", x, y: speed }, { label: "safe curve", kind: "bound", ...(curves.safe ?? { x: [], y: [] }) },
             { label: "nominal curve, by μ̂", kind: "nominal", ...(curves.nominal ?? { x: [], y: [] }) });
  const shown = [train?.speed ?? 0, ...past[3], ...speed].filter((y) => y !== null), marks = [];
  const ends = [here + 1000, limits?.target_m ?? here, ...(curves.nominal?.x.slice(-1) ?? [])];
  if (train !== null) marks.push({ x: here, y: train.speed, kind: "run", label: "" });
  if (limits?.target_m != null) marks.push({ x: limits.target_m, y: limits.target_kmh, kind: "target", label: `target ${number(limits.target_kmh, 0)} km/h` });
  way.draw({ title: "Speed along the track and its limits, km/h", x: { label: "position, m", sign: state.sign, range: [here - BEHIND_M, Math.max(...ends) + 500] },
             y: { range: [0, 1.08 * Math.max(50, ...shown)] }, lines, marks });
}

// Each regime holds since the estimate before; equal neighbours are one band.
function bandsOf(history) {
  const bands = [];
  history.forEach((row, i) => {
    const last = bands.at(-1), from = i ? history[i - 1].t : row.t;
    if (last?.kind === row.regime) last.to = row.t;
    else bands.push({ from, to: row.t, kind: row.regime, label: "" });
  });
  return bands;
}

function toldOf(adhesion, estimator) {
  if (adhesion === null) return `nothing is known of μ${age(MU) === Infinity ? " yet" : `: the last value is ${age(MU).toFixed(0)} s old`}`;
  const bound = `at least ${number(adhesion.mu_lower, 4)}${estimator?.confidence ? ` (${Number(estimator.confidence) * 100} %)` : ""}`;
  const mu = number(adhesion.mu, 4);
  return { identified: `identified μ̂ ${mu}, ${bound}`, atleast: `μ ≥ ${mu}, which the brake uses; ${bound}`, known: `μ̂ ${mu}, ${bound}`,
           prior: `not identified; prior ${mu}, not claimed; ${bound}` }[adhesion.kind];
}

function drawGauge(adhesion, end) {
  const share = (value) => `${(100 * Math.min(Math.max(value / end, 0), 1)).toFixed(2)}%`, gauge = byId("gauge");
  const mark = (value, name, label) => element("span", { class: `at ${name}`, style: `left:${share(value)}`, title: `${label} ${value}` });
  const step = end > 0.3 ? 0.1 : 0.05, ticks = Array.from({ length: Math.floor(end / step + 1e-6) + 1 }, (_, i) => i * step);
  const parts = [element("span", { class: "scale" }), mark(FIXED_MU, "fixed", "fixed worst case")];
  if (adhesion !== null) {
    const { kind } = adhesion, low = Math.min(adhesion.mu_lower, adhesion.mu), high = kind === "atleast" ? end : adhesion.mu;
    parts.push(element("span", { class: `span ${kind}`, style: `left:${share(low)};width:calc(${share(high)} - ${share(low)})` }), mark(adhesion.mu_lower, "bound", "at least"), mark(adhesion.mu, kind, kind));
    if (adhesion.true_mu !== undefined) parts.push(mark(adhesion.true_mu, "truth", "true"));
  }
  gauge.replaceChildren(...parts, ...ticks.map((value) => element("span", { class: "number", style: `left:${share(value)}` }, String(Number(value.toFixed(2))))));
}

function drawAdhesion() {
  const adhesion = fresh(MU, state.adhesion), estimator = fresh(STATE, state.estimator), { history } = state;
  say("regime", `Adhesion: ${estimator?.words ?? "not known"}`);
  say("mu", toldOf(adhesion, estimator));
  const [t, mu, bound, truth] = columns(history, "t", ["mu", "mu_lower", "true_mu"], GAP_S), kinds = new Map(history.map((row) => [row.t, row.kind]));
  const values = [FIXED_MU, ...mu, ...truth].filter((value) => value !== null), end = Math.max(0.1, Math.ceil(1.15 * Math.max(...values) / 0.05) * 0.05);
  drawGauge(adhesion, end);
  const until = Math.max(t.at(-1) ?? 0, 30), from = Math.max(until - SHOWN_S, 0), of = (kind) => mu.map((value, i) => (kinds.get(t[i]) === kind ? value : null));
  const lines = [{ label: `fixed worst case ${FIXED_MU}`, kind: "fixed", x: [from, until], y: [FIXED_MU, FIXED_MU] }, { label: "at least", kind: "bound", x: t, y: bound },
    ...Object.entries(KINDS).map(([kind, label]) => ({ label, kind, x: t, y: of(kind) }))];
  if (truth.some((value) => value !== null)) lines.splice(1, 0, { label: "true", kind: "truth", x: t, y: truth });
  course.draw({ title: "Adhesion coefficient", x: { label: "time, s", range: [from, until] }, y: { range: [0, end] }, lines, bands: bandsOf(history),
                events: state.events.map((event) => ({ x: event.t, kind: event.kind })) });
}

function drawHealth() {
  const { estimator, inputs, events } = state;
  rows(byId("inputs"), Object.entries(inputs).map(([topic, input]) => {
    const old = since(state.heard[topic]), kind = silent() ? "unknown" : input.state !== "heard" ? input.state : old > STALE_S ? "late" : "good";
    return [input.name, element("td", { class: "wide" }, topic), element("td", { class: kind }, kind), kind === "late" || silent() ? "–" : number(input.hz, 1, " Hz"),
            old === Infinity ? "–" : `${number(old, 1)} s ago${input.why ? `: ${input.why}` : ""}`];
  }));
  const told = fresh(STATE, estimator) === null ? `silent ${forFor(STATE)}` : estimator.message;
  say("estimator", estimator == null ? "" : `Estimator: ${told}. ${estimator.accepted ?? 0} of ${estimator.measurements ?? 0} positions used; ` +
    `not used: ${Object.entries(estimator.dropped).map(([why, count]) => `${count} ${why}`).join(", ") || "none"}.`);
  const key = JSON.stringify(events.slice(-EVENTS_SHOWN));
  if (byId("events").dataset.key === key) return;
  byId("events").dataset.key = key;
  byId("events").replaceChildren(...events.slice(-EVENTS_SHOWN).reverse().map((event) => element("li", { class: `event ${event.kind}` }, `${event.t.toFixed(0)} s: ${event.text}`)));
}

function drawCreep() {
  const { creep } = state, old = creep == null ? 0 : since(creep.heard), gone = silent() || old > STALE_S;
  byId("creep").hidden = creep == null;
  if (creep == null) return;
  say("creep-text", gone ? `nothing from the creep estimator for ${old.toFixed(0)} s` : creepText(creep));
  drawCreepCurve(slip, creep, gone);
}

function drawState() {
  const gone = silent(), gone_s = ((Date.now() - heardAt) / 1000).toFixed(0);
  document.body.classList.toggle("silent", gone);
  byId("nodata").hidden = !gone;
  if (gone) say("nodata", `NO DATA since ${heardAt.toLocaleTimeString("en-GB")} (${gone_s} s): is the program running?`);
  const at = state.train == null ? "waiting for the estimator" : fresh(STATE, state.train) === null ? `estimator silent ${forFor(STATE)}` : `${state.train.t.toFixed(0)} s`;
  say("state", gone ? "no data" : state.ended ? `${number(state.train?.t, 0)} s, the run has ended` : at);
  say("announce", gone ? "No data" : `${byId("level").textContent.replace(/ for \d+ s$/, "")}. ${byId("regime").textContent}`);
}

function draw() {
  dirty = false;
  for (const part of [drawCab, drawWay, drawAdhesion, drawHealth, drawCreep, drawState]) part();
}

function take(event) {
  const { now, all, set, change, add } = JSON.parse(event.data);
  if (all !== undefined) state = nothing();
  Object.assign(state, all, set, { now });
  for (const [name, entries] of Object.entries(change ?? {})) state[name] = { ...state[name], ...entries };
  for (const [name, more] of Object.entries(add ?? {})) state[name] = [...state[name], ...more].slice(-600);
  [ahead_s, heard_s, heardAt] = [now - seconds(), seconds(), new Date()];
  if (!dirty) requestAnimationFrame(draw);
  dirty = true;
}

function connect() {
  const socket = new WebSocket(new URL("events", location.href.replace(/^http/, "ws")));
  socket.addEventListener("message", take);
  socket.addEventListener("close", () => setTimeout(connect, RETRY_MS));
}

addEventListener("beforeprint", () => say("printed", `printed ${new Date().toLocaleString("sv-SE")}`));
connect();
// Ages grow without any message; a frame that never comes, in a hidden tab, does not stop them.
setInterval(draw, 250);

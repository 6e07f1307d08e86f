// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// The speed dial in the manner of a driver-machine interface, ERA_ERTMS_015560: grey below the indication; behind it white up
// to the target speed and yellow up to the permitted one; orange or red from there to the service brake's. Left of it the
// distance to the target. Other than there the emergency brake's limit has a mark, and a warning a broken hub.

const DIAL_ENDS = [140, 180, 250, 400], SWEEP = 144, RADIUS = 158, BAR_M = 5000, BAR = { x: 10, top: 40, high: 240 };
const COLOURS = { INDICATION: "yellow", OVERSPEED: "orange", WARNING: "orange", SERVICE_BRAKE: "red", EMERGENCY_BRAKE: "red" };

function dial(host) {
  const svg = host.appendChild(shape("svg", { viewBox: "-30 10 430 310", role: "img" }));
  let end = DIAL_ENDS[0], key = "";

  const angle = (speed) => ((-SWEEP + (2 * SWEEP * Math.min(Math.max(speed, 0), end)) / end) * Math.PI) / 180;
  const at = (speed, radius) => `${(200 + radius * Math.sin(angle(speed))).toFixed(1)},${(185 - radius * Math.cos(angle(speed))).toFixed(1)}`;

  function arc(from, to, width, kind) {
    if (to === null || to <= from) return [];
    const radius = RADIUS + width / 2, large = angle(to) - angle(from) > Math.PI ? 1 : 0;
    return [shape("path", { d: `M${at(from, radius)}A${radius},${radius} 0 ${large} 1 ${at(to, radius)}`, "stroke-width": width, class: `arc ${kind}` })];
  }

  const hook = (speed, kind) => (speed === null ? [] : [shape("path", { d: `M${at(speed, RADIUS - 4)}L${at(speed, RADIUS + 22)}`, class: `hook ${kind}` })]);

  function ticks() {
    const wide = end > 250 ? 50 : 20;
    return Array.from({ length: end / 10 + 1 }, (_, i) => 10 * i).flatMap((speed) => {
      const major = speed % wide === 0, mark = shape("path", { d: `M${at(speed, RADIUS - 3)}L${at(speed, RADIUS - (major ? 18 : 9))}`, class: major ? "tick" : "tick minor" });
      if (!major) return [mark];
      const [x, y] = at(speed, RADIUS - 33).split(",");
      return [mark, shape("text", { x, y: Number(y) + 5, "text-anchor": "middle" }, String(speed))];
    });
  }

  // As high as the distance, by its logarithm beyond 100 m.
  function bar(left) {
    if (left === null || left < 0) return [];
    const part = (metres) => Math.min(metres <= 100 ? (0.2 * metres) / 100 : 0.2 + (0.8 * Math.log(metres / 100)) / Math.log(BAR_M / 100), 1);
    const bottom = BAR.top + BAR.high, marks = [0, 100, 500, 1000, 5000].map((metres) => shape("text", { x: BAR.x - 6, y: bottom - BAR.high * part(metres) + 4, "text-anchor": "end" }, String(metres)));
    return [shape("rect", { x: BAR.x, y: bottom - BAR.high * part(left), width: 14, height: BAR.high * part(left), class: "bar" }), ...marks,
            shape("text", { x: BAR.x - 30, y: 28, class: "left" }, `${left.toFixed(0)} m`)];
  }

  // `limits` may be null, and so may each of its speeds, and the distance left.
  return function draw(speed, limits, left) {
    const { target_kmh: target = null, permitted = null, sbi = null, ebi = null, level = "" } = limits ?? {};
    if (key === (key = JSON.stringify([speed, target, permitted, sbi, ebi, level, left]))) return;
    end = DIAL_ENDS.find((candidate) => candidate >= Math.max(speed ?? 0, ebi ?? 0, end)) ?? DIAL_ENDS.at(-1);
    const aims = level in COLOURS, colour = COLOURS[level] ?? "grey", over = colour === "orange" || colour === "red";
    const low = Math.min(target ?? 0, permitted ?? 0), slow = speed === null || (aims && !over && speed <= (target ?? 0));
    const bands = permitted === null ? [] : [...arc(0, low, 8, aims ? "white" : "dark"), ...arc(low, permitted, 8, aims ? (over ? "white" : "yellow") : "dark"), ...(over ? arc(permitted, sbi, 18, colour) : []),
      ...hook(permitted, aims ? (over ? "white" : "yellow") : "grey"), ...hook(ebi, "ebi")];
    const pointer = `pointer ${slow ? "grey" : colour}${level === "WARNING" ? " warns" : ""}`;
    const needle = speed === null ? [] : [shape("path", { d: `M${at(speed - 0.012 * end, 40)}L${at(speed, RADIUS - 6)}L${at(speed + 0.012 * end, 40)}Z`, class: pointer })];
    svg.replaceChildren(...bands, ...ticks(), ...(target === null ? [] : hook(target, "aim")), ...(aims ? bar(left) : []), ...needle, shape("circle", { cx: 200, cy: 185, r: 50, class: pointer }),
      shape("text", { x: 200, y: 196, "text-anchor": "middle", class: `digits on-${slow ? "grey" : colour}` }, speed === null ? "–" : speed.toFixed(0)),
      shape("text", { x: 200, y: 216, "text-anchor": "middle", class: `unit on-${slow ? "grey" : colour}` }, "km/h"));
    svg.setAttribute("aria-label", `speed ${speed === null ? "unknown" : `${speed.toFixed(0)} km/h`}`);
  };
}

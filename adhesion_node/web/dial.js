// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// The speed dial in the manner of a driver-machine interface: bands up to the permitted speed, to the service brake's
// and to the emergency brake's intervention. The bands grow wider with urgency, to be told apart without colours.

const DIAL_ENDS = [140, 180, 250, 400], SWEEP = 144, RADIUS = 158;

function dial(host) {
  const svg = host.appendChild(shape("svg", { viewBox: "0 0 400 330", role: "img" }));
  let end = DIAL_ENDS[0];

  const angle = (speed) => ((-SWEEP + (2 * SWEEP * Math.min(Math.max(speed, 0), end)) / end) * Math.PI) / 180;
  const at = (speed, radius) => `${(200 + radius * Math.sin(angle(speed))).toFixed(1)},${(185 - radius * Math.cos(angle(speed))).toFixed(1)}`;

  function arc(from, to, width, kind) {
    if (to <= from) return "";
    const radius = RADIUS + width / 2, large = angle(to) - angle(from) > Math.PI ? 1 : 0;
    return shape("path", { d: `M${at(from, radius)}A${radius},${radius} 0 ${large} 1 ${at(to, radius)}`, "stroke-width": width, class: `arc ${kind}` });
  }

  function ticks() {
    const wide = end > 250 ? 50 : 20;
    return Array.from({ length: end / 10 + 1 }, (_, i) => 10 * i).flatMap((speed) => {
      const major = speed % wide === 0, mark = shape("path", { d: `M${at(speed, RADIUS - 3)}L${at(speed, RADIUS - (major ? 18 : 9))}`, class: major ? "tick" : "tick minor" });
      if (!major) return [mark];
      const [x, y] = at(speed, RADIUS - 33).split(",");
      return [mark, shape("text", { x, y: Number(y) + 5, "text-anchor": "middle" }, String(speed))];
    });
  }

  // `limits` may be null, and so may each of its speeds.
  return function draw(speed, limits) {
    const { target_kmh: target = null, permitted = null, sbi = null, ebi = null, level = "" } = limits ?? {};
    const fastest = Math.max(speed ?? 0, ebi ?? 0);
    end = DIAL_ENDS.find((candidate) => candidate >= Math.max(fastest, end)) ?? DIAL_ENDS.at(-1);
    const bands = permitted === null ? [] : [
      arc(0, Math.min(target ?? 0, permitted), 8, "target"), arc(Math.min(target ?? 0, permitted), permitted, 8, "permitted"),
      arc(permitted, sbi, 15, "warning"), arc(sbi, ebi, 24, "intervention")];
    const aim = target === null ? [] : [shape("path", { d: `M${at(target, RADIUS - 4)}L${at(target, RADIUS + 24)}`, class: "aim" })];
    const pointer = speed === null ? [] : [shape("path", { d: `M${at(speed - 0.012 * end, 40)}L${at(speed, RADIUS - 6)}L${at(speed + 0.012 * end, 40)}Z`, class: `pointer ${level.toLowerCase()}` })];
    const hub = shape("circle", { cx: 200, cy: 185, r: 50, class: `pointer ${level.toLowerCase()}` });
    const digits = shape("text", { x: 200, y: 196, "text-anchor": "middle", class: "digits" }, speed === null ? "–" : speed.toFixed(0));
    const unit = shape("text", { x: 200, y: 216, "text-anchor": "middle", class: "unit" }, "km/h");
    svg.replaceChildren(...bands, ...ticks(), ...aim, ...pointer, hub, digits, unit);
    svg.setAttribute("aria-label", `speed ${speed === null ? "unknown" : speed.toFixed(0)} km/h`);
  };
}

// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// Line charts in SVG, the same for the report and the live page. Colours and dashes are classes of style.css, so that
// a line is told by its dash where there is no colour.

const HEIGHT = 240, MARGIN = { left: 52, right: 12, top: 10, bottom: 34 };

// An element of HTML, or of SVG where `svg` is true.
function element(name, attributes = {}, text = "", svg = false) {
  const made = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== "") made.textContent = text;
  return made;
}

function shape(name, attributes, text) {
  return element(name, attributes, text, true);
}

// About `wanted` round numbers from `low` to `high`.
function ticks(low, high, wanted) {
  const raw = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((candidate) => candidate >= raw);
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(10)));
}

// A chart below `host`. spec: {title, x: {label, range}, y: {range}, lines: [{label, kind, x, y, dots}],
// bands: [{from, to, kind, label}], marks: [{x, y, kind, label}]}; lines may have null for gaps. Returns draw(spec) and
// cursor(x); `onPick` hears of a place chosen with the pointer.
function chart(host, onPick = null) {
  const figure = host.appendChild(element("figure", { class: "chart" }));
  const caption = figure.appendChild(element("figcaption"));
  const svg = figure.appendChild(shape("svg", { role: "img" }));
  const legend = figure.appendChild(element("div", { class: "legend" }));
  const clip = `clip${document.querySelectorAll("figure.chart").length}`;
  let spec = null, at = null, pointer = null, width = 0, legendKey = "";

  const sx = (x) => MARGIN.left + ((x - spec.x.range[0]) / (spec.x.range[1] - spec.x.range[0])) * (width - MARGIN.left - MARGIN.right);
  const sy = (y) => HEIGHT - MARGIN.bottom - ((y - spec.y.range[0]) / (spec.y.range[1] - spec.y.range[0])) * (HEIGHT - MARGIN.top - MARGIN.bottom);
  const point = (x, y) => `${sx(x).toFixed(1)},${sy(y).toFixed(1)}`;

  function path(line) {
    let pen = "M";
    return line.x.map((x, i) => {
      if (line.y[i] === null) { pen = "M"; return ""; }
      const step = pen + point(x, line.y[i]);
      pen = "L";
      return step;
    }).join("");
  }

  function axes() {
    const drawn = shape("g", { class: "axes" }), bottom = HEIGHT - MARGIN.bottom;
    for (const x of ticks(...spec.x.range, Math.max(width / 90, 2))) {
      drawn.append(shape("path", { d: `M${sx(x)},${MARGIN.top}V${bottom}` }));
      drawn.append(shape("text", { x: sx(x), y: bottom + 15, "text-anchor": sx(x) > width - 25 ? "end" : "middle" }, String(x)));
    }
    for (const y of ticks(...spec.y.range, 5)) {
      drawn.append(shape("path", { d: `M${MARGIN.left},${sy(y)}H${width - MARGIN.right}`, class: y === 0 ? "zero" : "" }));
      drawn.append(shape("text", { x: MARGIN.left - 6, y: sy(y) + 4, "text-anchor": "end", class: "y" }, String(y)));
    }
    drawn.append(shape("text", { x: width - MARGIN.right, y: HEIGHT - 4, "text-anchor": "end" }, spec.x.label));
    return drawn;
  }

  function bands() {
    const drawn = shape("g", { class: "bands" });
    for (const band of spec.bands ?? []) {
      const left = sx(Math.max(band.from, spec.x.range[0])), wide = sx(Math.min(band.to, spec.x.range[1])) - left;
      if (wide <= 0) continue;
      drawn.append(shape("rect", { x: left, y: MARGIN.top, width: wide, height: HEIGHT - MARGIN.top - MARGIN.bottom, class: band.kind }));
      if (wide > 7 * band.label.length) drawn.append(shape("text", { x: left + 4, y: MARGIN.top + 12 }, band.label));
    }
    return drawn;
  }

  function curves() {
    const drawn = shape("g", { "clip-path": `url(#${clip})` });
    for (const line of spec.lines) {
      drawn.append(shape("path", { d: path(line), class: `line ${line.kind}` }));
      if (!line.dots) continue;
      line.x.forEach((x, i) => line.y[i] === null || drawn.append(shape("circle", { cx: sx(x), cy: sy(line.y[i]), r: 2, class: line.kind })));
    }
    for (const mark of spec.marks ?? []) {
      const right = sx(mark.x) > width - 8 * mark.label.length - 30;
      drawn.append(shape("circle", { cx: sx(mark.x), cy: sy(mark.y), r: 5, class: `mark ${mark.kind}` }));
      drawn.append(shape("text", { x: sx(mark.x) + (right ? -9 : 9), y: sy(mark.y) - 8, "text-anchor": right ? "end" : "start", class: "mark" }, mark.label));
    }
    return drawn;
  }

  // The legend is only made anew when its entries change: it would flicker on the live page.
  function describe() {
    const entries = spec.lines.map((line) => [line.label, `line ${line.kind}`]);
    if (legendKey === (legendKey = JSON.stringify(entries))) return;
    legend.replaceChildren(...entries.map(([label, kind]) => {
      const entry = element("span"), sample = shape("svg", { width: 30, height: 10 });
      sample.append(shape("path", { d: "M0,5H30", class: kind }));
      entry.append(sample, label);
      return entry;
    }));
  }

  function draw(wanted = spec) {
    spec = wanted;
    width = figure.clientWidth || 640;
    if (spec === null) return;
    caption.textContent = spec.title;
    svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    svg.setAttribute("aria-label", spec.title);
    const frame = shape("clipPath", { id: clip });
    frame.append(shape("rect", { x: MARGIN.left, y: 0, width: Math.max(width - MARGIN.left - MARGIN.right, 0), height: HEIGHT - MARGIN.bottom }));
    pointer = shape("path", { class: "cursor" });
    svg.replaceChildren(frame, bands(), axes(), curves(), pointer);
    describe();
    cursor(at);
  }

  function cursor(x) {
    at = x;
    if (pointer !== null && x !== null) pointer.setAttribute("d", `M${sx(x)},${MARGIN.top}V${HEIGHT - MARGIN.bottom}`);
  }

  function pick(event) {
    if (!event.buttons || spec === null) return;
    const box = svg.getBoundingClientRect(), inside = (event.clientX - box.left) * (width / box.width) - MARGIN.left;
    onPick(spec.x.range[0] + (inside / (width - MARGIN.left - MARGIN.right)) * (spec.x.range[1] - spec.x.range[0]));
  }

  if (onPick !== null) for (const kind of ["pointerdown", "pointermove"]) svg.addEventListener(kind, pick);
  new ResizeObserver(() => { if (figure.clientWidth !== width) draw(); }).observe(figure);
  return { draw, cursor };
}

// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// Line charts by uPlot, the same for the report and the live page. How a line of a kind looks stands in LOOKS and, its
// colour, in style.css: lines are told by their dashes where there is no colour.

const LOOKS = {
  truth: { width: 2.2 }, identified: { points: 4 }, known: {}, nominal: {}, atleast: { arrows: true }, prior: { dash: [2, 4] }, bound: { dash: [7, 4] },
  fixed: { dash: [2, 3], width: 2.2 }, run: { width: 2.2 }, permitted: { width: 2.2 }, warning: { dash: [10, 3] }, sbi: { dash: [5, 3] },
  ebi: { dash: [9, 3, 2, 3] },
};
const FONT = "12px system-ui, sans-serif", ARROW_EVERY_PX = 22, ZOOM_STEP = 1.25;

function element(name, attributes = {}, text = "", svg = false) {
  const made = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== "") made.textContent = text;
  return made;
}

const shape = (name, attributes, text) => element(name, attributes, text, true);

// The colour of a class `ink KIND`, as the present scheme, forced colours or print have it.
const inks = new Map(), probe = document.body.appendChild(element("span", { hidden: "" }));
function ink(kind) {
  if (!inks.has(kind)) {
    probe.className = `ink ${kind}`;
    inks.set(kind, getComputedStyle(probe).color);
  }
  return inks.get(kind);
}

const drawn = new Set(), schemes = ["(prefers-color-scheme: dark)", "(forced-colors: active)", "print"].map((query) => matchMedia(query));
function drawAllAnew() {
  inks.clear();
  drawn.forEach((one) => one.fit());
}
for (const scheme of schemes) scheme.addEventListener("change", drawAllAnew);
// Paper is narrower than most screens: what is printed is drawn for it.
for (const kind of ["before", "after"]) {
  addEventListener(`${kind}print`, () => {
    document.body.classList.toggle("printing", kind === "before");
    drawAllAnew();
  });
}

// A stretch of x that several charts show together; `zoom` is null while they show all, `onChange` hears of it.
function shared(onChange = () => {}) {
  const view = { zoom: null, members: new Set(), show(from, to) { view.zoom = from === null ? null : [from, to]; view.members.forEach((member) => member.rescale()); onChange(); } };
  return view;
}

// A chart below `host`; it is drawn by draw(spec) with {title, x: {label, range, sign}, y: {range}, lines: [{label, kind, x, y}],
// bands: [{from, to, kind, label}], marks: [{x, y, kind, label}], events: [{x, kind, label}]}; null in a line is a gap.
// cursor(x) marks the present; `onPick` hears of a place clicked. The wheel, a drag, + and - zoom, Shift and a drag, a
// swipe to the side or the arrows pan, a double click or 0 shows all again.
function chart(host, { view = shared(), onPick = null } = {}) {
  const figure = host.appendChild(element("figure", { class: "chart" })), caption = figure.appendChild(element("figcaption"));
  const area = figure.appendChild(element("div", { class: "area" }));
  let spec = null, plot = null, key = "", at = null, pointer = null;
  const range = () => view.zoom ?? spec.x.range;

  function zoomTo(from, to) {
    const [low, high] = spec.x.range, wide = Math.min(Math.max(to - from, (high - low) / 1e4), high - low);
    const start = Math.min(Math.max(from, low), high - wide);
    view.show(wide >= 0.999 * (high - low) ? null : start, start + wide);
  }
  function scale(factor, around) {
    const [from, to] = range();
    zoomTo(around - (around - from) * factor, around + (to - around) * factor);
  }
  const pan = (share) => { const [from, to] = range(), by = share * (to - from); zoomTo(from + by, to + by); };

  // Bands below the grid, `write` their names on it: a line of the grid through a letter makes another one.
  const bands = (write) => (u) => {
    const { ctx, bbox } = u, px = uPlot.pxRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    // The axes leave an alignment of their own.
    [ctx.font, ctx.textAlign, ctx.textBaseline] = [`${11 * px}px system-ui, sans-serif`, "left", "alphabetic"];
    for (const band of spec.bands ?? []) {
      const left = Math.max(u.valToPos(band.from, "x", true), bbox.left), right = Math.min(u.valToPos(band.to, "x", true), bbox.left + bbox.width);
      if (right <= left) continue;
      ctx.fillStyle = ink(write ? "soft" : `band ${band.kind}`);
      if (!write) ctx.fillRect(left, bbox.top, right - left, bbox.height);
      else if (right - left > ctx.measureText(band.label).width + 8 * px) ctx.fillText(band.label, left + 4 * px, bbox.top + 12 * px);
    }
    ctx.restore();
  };

  function over(u) {
    const { ctx, bbox } = u, px = uPlot.pxRatio, bottom = bbox.top + bbox.height;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left - 6 * px, 0, bbox.width + 12 * px, bottom + 6 * px);
    ctx.clip();
    spec.lines.forEach((line, i) => LOOKS[line.kind].arrows && arrows(u, i + 1));
    [ctx.font, ctx.textBaseline] = [`600 ${11 * px}px system-ui, sans-serif`, "alphabetic"];
    for (const event of spec.events ?? []) {
      const x = u.valToPos(event.x, "x", true);
      ctx.fillStyle = ink(`event ${event.kind}`);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x - 5 * px, bbox.top - 8 * px);
      ctx.lineTo(x + 5 * px, bbox.top - 8 * px);
      ctx.fill();
    }
    for (const mark of spec.marks ?? []) {
      const x = u.valToPos(mark.x, "x", true), y = u.valToPos(mark.y, "y", true), right = x > bbox.left + bbox.width - 110 * px;
      ctx.fillStyle = ink(mark.kind);
      ctx.beginPath();
      ctx.arc(x, y, 5 * px, 0, 7);
      ctx.fill();
      ctx.textAlign = right ? "right" : "left";
      [ctx.strokeStyle, ctx.lineWidth, ctx.lineJoin] = [ink("paper"), 4 * px, "round"];
      for (const write of ["strokeText", "fillText"]) ctx[write](mark.label, x + (right ? -9 : 9) * px, y - 8 * px);
    }
    ctx.restore();
    place();
  }

  // An interval that is open above: arrows upwards from its lower end.
  function arrows(u, i) {
    const { ctx } = u, px = uPlot.pxRatio, [xs, ys] = [u.data[0], u.data[i]], [first, last] = u.series[0].idxs;
    ctx.strokeStyle = ink("atleast");
    ctx.lineWidth = 1.4 * px;
    ctx.beginPath();
    let before = -Infinity;
    for (let k = first; k <= last; k++) {
      const x = u.valToPos(xs[k], "x", true);
      if (ys[k] == null || x - before < ARROW_EVERY_PX * px) continue;
      const y = u.valToPos(ys[k], "y", true), top = y - 13 * px;
      before = x;
      for (const [dx, dy] of [[0, y], [0, top], [-3 * px, top + 5 * px], [0, top], [3 * px, top + 5 * px]]) dy === y ? ctx.moveTo(x + dx, dy) : ctx.lineTo(x + dx, dy);
    }
    ctx.stroke();
  }

  function make() {
    // Without a pointer the legend has no values: a dash would say that there is none.
    const value = (_, number, _series, i) => (i == null ? "" : number == null ? "–" : Number(number.toPrecision(4)).toString());
    const wide = (_, labels) => Math.max(52, 7 * Math.max(...(labels ?? []).map((label) => label.length)) + 18);
    // Along the run places count upwards; they are told as they stand on the line.
    const told = (x) => Number((x * (spec.x.sign ?? 1)).toPrecision(10)).toString();
    const axis = (more) => ({ stroke: () => ink("soft"), font: FONT, labelFont: FONT, grid: { stroke: () => ink("rule"), width: 1 }, ticks: { stroke: () => ink("rule"), width: 1 }, ...more });
    plot?.destroy();
    plot = new uPlot({
      width: area.clientWidth || 640, height: area.clientHeight || 240, padding: [12, 12, 0, 0],
      scales: { x: { time: false, range }, y: { range: () => spec.y.range } },
      axes: [axis({ label: spec.x.label, labelSize: 18, size: 28, space: 70, values: (_, splits) => splits.map(told) }), axis({ size: wide, space: 30 })],
      series: [{ label: spec.x.label, value: (_, x, _series, i) => (i == null ? "" : told(Number(x.toPrecision(6)))) }, ...spec.lines.map((line) => {
        const look = LOOKS[line.kind];
        return { label: line.label, value, stroke: () => ink(line.kind), width: look.width ?? 1.6, dash: look.dash, points: { show: look.points !== undefined, size: look.points, fill: () => ink(line.kind) } };
      })],
      legend: { mount: (_, legend) => area.after(legend), markers: { width: 3, stroke: () => "currentColor", dash: (u, i) => (LOOKS[spec.lines[i - 1]?.kind]?.dash ? "dashed" : "solid") } },
      cursor: { sync: { key: spec.x.label, scales: ["x", null] }, drag: { x: true, y: false, setScale: false }, points: { size: 6 },
                bind: { dblclick: () => () => view.show(null),
                        mousedown: (u, _, handler) => (event) => (event.shiftKey ? drag(event) : handler(event)) } },
      hooks: { drawClear: [bands(false)], drawAxes: [bands(true)], draw: [over], setSelect: [select], setCursor: [point] },
    }, table(), area);
    point(plot);
    figure.querySelectorAll(".u-marker").forEach((marker, i) => i > 0 && marker.classList.add("ink", spec.lines[i - 1].kind));
    pointer = plot.over.appendChild(element("div", { class: "present" }));
    const wrap = plot.root.querySelector(".u-wrap");
    for (const [name, text] of Object.entries({ tabindex: 0, role: "group", "aria-label": `${spec.title}: chart` })) wrap.setAttribute(name, text);
    wrap.addEventListener("keydown", press);
    plot.over.addEventListener("wheel", (event) => {
      event.preventDefault();
      if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) pan(event.deltaX / plot.over.clientWidth); // a swipe to the side
      else scale(event.deltaY < 0 ? 1 / ZOOM_STEP : ZOOM_STEP, plot.posToVal(event.offsetX, "x"));
    }, { passive: false });
    plot.over.addEventListener("click", (event) => onPick?.(plot.posToVal(event.offsetX, "x")));
  }

  // Without a pointer the legend does not name x. WebKit does not follow `:has(:empty)` here, a class it does.
  function point(u) { figure.classList.toggle("pointed", u.cursor.idx != null); }

  function select(u) {
    const { left, width } = u.select;
    if (width < 4) return;
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    zoomTo(u.posToVal(left, "x"), u.posToVal(left + width, "x"));
  }

  function drag(start) {
    const [from, to] = range(), perPx = (to - from) / plot.over.clientWidth;
    const move = (event) => zoomTo(from - (event.clientX - start.clientX) * perPx, to - (event.clientX - start.clientX) * perPx);
    addEventListener("mousemove", move);
    addEventListener("mouseup", () => removeEventListener("mousemove", move), { once: true });
  }

  function press(event) {
    const [from, to] = range(), middle = at !== null && at >= from && at <= to ? at : (from + to) / 2;
    const action = { ArrowLeft: () => pan(-0.1), ArrowRight: () => pan(0.1), "+": () => scale(1 / ZOOM_STEP, middle), "=": () => scale(1 / ZOOM_STEP, middle),
                     "-": () => scale(ZOOM_STEP, middle), 0: () => view.show(null) }[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  // uPlot wants one x for all lines; a chart without any point still has its axes. A gap reaches to the line's own next
  // points (2), whatever other lines have within it.
  const table = () => {
    const tables = [[spec.x.range, [null, null]], ...spec.lines.map((line) => [line.x, line.y])];
    return uPlot.join(tables, tables.map(() => [2, 2])).toSpliced(1, 1);
  };

  function draw(wanted = spec) {
    spec = wanted;
    if (spec === null) return;
    caption.textContent = spec.title;
    const lines = JSON.stringify([spec.title, spec.x.label, spec.lines.map((line) => [line.label, line.kind])]);
    if (key !== (key = lines)) make();
    else {
      plot.setData(table(), false);
      rescale();
    }
  }

  const rescale = () => { const [min, max] = range(); plot?.setScale("x", { min, max }); };

  // At once: what is only queued comes too late for the paper, as Firefox may print before.
  function fit() {
    if (plot !== null && area.clientWidth > 0) plot.batch(() => plot.setSize({ width: area.clientWidth, height: area.clientHeight }));
  }

  function place() {
    if (pointer === null) return;
    pointer.hidden = at === null || at < range()[0] || at > range()[1];
    if (!pointer.hidden) pointer.style.transform = `translateX(${plot.valToPos(at, "x")}px)`;
  }

  const self = { draw, fit, rescale, cursor(x) { at = x; place(); }, get plot() { return plot; } };
  view.members.add(self);
  drawn.add(self);
  new ResizeObserver(fit).observe(area);
  return self;
}

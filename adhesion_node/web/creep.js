// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// The creep curve for the report and the live page, which have number(): identified, or withheld and then without its peak.

function creepText({ peak: [at, peak], lower, upper, withheld, why }) {
  return withheld ? `withheld: ${why}` : `peak ${number(peak, 3)} at a creep of ${number(at, 3)}, ${number(lower, 3)} to ${number(upper, 3)}`;
}

function drawCreepCurve(on, { peak: [at, peak], withheld, x, y }, blank) {
  on.draw({ title: "Adhesion over creep", x: { label: "creep", range: [0, x.at(-1)] }, y: { range: [0, 1.3 * Math.max(...y, 0.1)] },
            lines: [{ label: withheld ? "prior, withheld" : "identified", kind: withheld ? "prior" : "identified", x: blank ? [] : x, y: blank ? [] : y }],
            marks: blank || withheld || at > x.at(-1) ? [] : [{ x: at, y: peak, kind: "identified", label: "peak" }] });
}

// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"use strict";
// The pages are in English, and so are the numbers that uPlot writes beside ours. WebKitGTK without a language says "C",
// which uPlot does not survive.
Object.defineProperty(navigator, "language", { value: "en" });

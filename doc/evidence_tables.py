# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tables of what was measured, out of doc/evidence/*.json; under each the command that made it."""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from interface_tables import table

Row = Mapping[str, Any]
Crossed = tuple[tuple[str, str], str]
"""Line, column and cell."""

FOLDER = Path(__file__).resolve().parent / "evidence"
MADE_BY: dict[str, dict[str, str]] = json.loads((FOLDER / "made_by.json").read_text(encoding="utf-8"))
"""Command, seeds and settings by the name of the file they made."""
COLUMNS: dict[str, Sequence[tuple[str, str]]] = json.loads(Path(__file__).with_suffix(".json").read_text("utf-8"))
"""Heads of the tables, and the forms into which the numbers of a row are filled."""

SCENARIOS = {"tunnel_entry": "flat → wet tunnel, 300 → 100 km/h", "tunnel_exit": "tunnel → wet line, 250 → 50 km/h"}
METHODS = {
    "bank": "bank",
    "rail_condition": "rail condition",
    "particle_em": "paper's method",
    "ekf_tuned": "tuned EKF",
    "ekf_naive": "naive EKF",
}
PAPERS = {"particle_em": "paper", "ekf_naive": "paper's EKF"}

ERROR = "{mean_relative_error_percent:.2f} ± {std_relative_error_percent:.2f}"
PEAK = "{peak_estimated_mean:.3f} ± {peak_estimated_std:.3f}"
GOALS = {
    "error_percent": ("error against used: positions, aided, leaves, patches", "≤ 4, 2, 4, 6 %", "{by:+.1f} %", 1.0),
    "coverage95": ("95 % interval covers it", "92–99 %", "{by:+.1f} %", 100.0),
    "bound_kept": ("bound ≤ used", "≥ 95 %", "{by:+.1f} %", 100.0),
    "safe": ("safe curve long enough", "≥ 99 %", "{by:+.1f} %", 100.0),
    "shortfall_percent": ("worst shortfall", "≤ 5 %", "{by:+.1f} %", 1.0),
    "excess_percent": ("mean excess, sound sensors", "≤ 20 %", "{by:+.0f} %", 1.0),
    "regime_wrong": ("regime wrong", "≤ 5 %", "{by:+.1f} %", 100.0),
    "false_changes_per_hour": ("false changes", "≤ 1/h", "{by:+.1f}/h", 1.0),
    "speed_beyond_3_std": ("published speed beyond 3 σ", "≤ 2 %", "{by:+.1f} %", 100.0),
    "silence_s": ("longest silence", "≤ 1 s", "{by:+.1f} s", 1.0),
    "found_s": ("patch found", "≤ 1 s; positions alone 1.2 × soonest", "{by:+.1f} s", 1.0),
}
"""Figures of `study real` that have a goal: what it says, the goal, the form of a distance and its factor."""

BOUGHT = ("error, %", "bound", "safe")
BESIDE = (*BOUGHT, "covers", "short, %", "false/h")
"""Columns of the real train's table that stand in the shorter ones."""

RAILS = ("wet", "leaves")
"""Scenarios in which sets of sensors are compared."""

EARLIER = {"SBI": "sbi_m", "W": "warning_m", "P": "permitted_m", "I": "indication_m"}


def parts() -> dict[str, str]:
    """Return the tables by the name of their part."""
    files = {name: json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8")) for name in MADE_BY}
    robust, creep = files["robust"], files["creep"]
    rails, faults = ([row for row in robust if row["table"] == name] for name in ("rails", "faults"))
    listed: dict[str, tuple[str, Iterable[Row]]] = {
        "rails": ("robust", map(_found, rails)),
        "faults measured": ("robust", map(_lost, faults)),
        "bound": ("bound", map(_at_speeds, files["bound"])),
        "distances": ("distances", files["distances"]),
        "safety": ("safety", files["safety"]),
        "saved": ("distances", _saved(files["distances"])),
        "creep experiments": ("creep", (_switched(row) for row in creep if "samples" in row)),
        "creep withheld": ("creep", map(_wrong, creep[0]["withholding"])),
    }
    made = {name: (file, _listed(COLUMNS[name], rows)) for name, (file, rows) in listed.items()}
    for name in ("real", "real_before"):
        rows = ({"error_least_percent": None, "excess_least_percent": None, **row} for row in files[name])
        made[name] = name, _listed(COLUMNS["real"], rows, _marked)
    made["real soonest"] = "real", _listed(COLUMNS["real soonest"], _soonest(files["real"]))
    made["real goals"] = "real", table(("figure", "goal", "met", "missed most by"), _reached(files["real"]))
    made["real before and now"] = "real", table(("case", *BESIDE), _beside(files["real_before"], files["real"]))
    made["real sensors"] = (
        "real",
        table(("sensors", *(f"{rail}: {head}" for rail in RAILS for head in BOUGHT)), _bought(files["real"])),
    )
    made["creep noise"] = "creep", _crossed("noise on λ", _noise(creep))
    made["creep coverage"] = "creep", _crossed("", _coverage(creep[0]["coverage95"]))
    for name, scenario in SCENARIOS.items():
        accuracy, limits = ([row for row in files[f] if row["scenario"] == name] for f in ("tables", "intervention"))
        made[f"tables {name}"] = "tables", _crossed(f"{scenario}; start", _accuracy(accuracy))
        head = f"km/h, before {limits[0]['target_kmh']:.0f} km/h"
        made[f"intervention {name}"] = "intervention", _crossed(head, _limits(limits))
    return {name: f"{shown}\n\n{_source(file)}" for name, (file, shown) in made.items()}


def _source(file: str) -> str:
    of = MADE_BY[file]
    return f"*`{of['command']}`; {of['seeds']}; {of['settings']} (`doc/evidence/{file}.json`).*"


def _cell(form: str, row: Row) -> str:
    """Fill in a form; a dash where a number is missing: None takes no format."""
    try:
        return re.sub(r"(?<=\d)%", " %", form.format_map(row))
    except TypeError:
        return "–"


def _listed(columns: Sequence[tuple[str, str]], rows: Iterable[Row], cell: Callable[[str, Row], str] = _cell) -> str:
    return table([head for head, _ in columns], ([cell(form, row) for _, form in columns] for row in rows))


def _marked(form: str, row: Row) -> str:
    """Fill in a form, bold where its figure misses its goal."""
    shown = _cell(form, row)
    return f"**{shown}**" if any(f"{{{figure}:" in form for figure in row["missed"]) else shown


def _reached(rows: Sequence[Row]) -> Iterator[Sequence[str]]:
    """By goal: in how many of the cases that have a figure it is met, and where it is missed most."""
    for figure, (says, goal, form, factor) in GOALS.items():
        judged = [row for row in rows if row[figure] is not None and figure in row["goals"]]
        worst = max(judged, key=lambda row: abs(row["missed"].get(figure, 0.0)), default=None)
        by = 0.0 if worst is None else worst["missed"].get(figure, 0.0)
        met = sum(figure not in row["missed"] for row in judged)
        where = f"{form.format(by=factor * by)} ({worst['case']})" if worst is not None and by else "–"
        yield says, goal, f"{met} of {len(judged)}", where


def _beside(before: Sequence[Row], now: Sequence[Row]) -> Iterator[Sequence[str]]:
    """The cases that were measured before, too: each figure as it was and as it is."""
    was, forms = {row["case"]: row for row in before}, dict(COLUMNS["real"])
    for row in (row for row in now if row["case"] in was):
        cells = ((_marked(forms[head], was[row["case"]]), _marked(forms[head], row)) for head in BESIDE)
        yield row["case"], *(f"{then} → {after}" for then, after in cells)


def _bought(rows: Sequence[Row]) -> Iterator[Sequence[str]]:
    """Sets of sensors on the rails on which they are compared."""
    at, forms = {(row["scenario"], row["fitted"]): row for row in rows}, dict(COLUMNS["real"])
    for fitted in dict.fromkeys(fitted for rail, fitted in at if rail in RAILS):
        own = [at.get((rail, fitted)) for rail in RAILS]
        yield f"`{fitted}`", *("–" if row is None else _marked(forms[head], row) for row in own for head in BOUGHT)


def _crossed(corner: str, found: Iterable[Crossed]) -> str:
    """Return a table of cells by line and column, both in the order of their first cell."""
    cells = dict(found)
    lines, columns = (list(dict.fromkeys(key[i] for key in cells)) for i in (0, 1))
    return table((corner, *columns), ((line, *(cells.get((line, column), "") for column in columns)) for line in lines))


def _accuracy(rows: Sequence[Row]) -> Iterator[Crossed]:
    """Mean relative error by start and method, then what holds of the mean over the starts."""
    for row in rows:
        start, method = row["start_mu"], row["method"]
        line = "**mean**" if start == "mean" else f"{start:g}"
        yield (line, METHODS[method]), _cell(ERROR, row)
        if method in PAPERS:
            yield (line, PAPERS[method]), _cell("{paper_mean_relative_error_percent:.2f}", row)
        if start == "mean":
            converged = "never" if row["converged_kmh"] is None else f"{row['converged_kmh']:.0f} km/h"
            for name, form in COLUMNS["of all starts"]:
                yield (name, METHODS[method]), _cell(form, {**row, "converged": converged})


def _soonest(rows: Sequence[Row]) -> Iterator[Row]:
    """By what the bound allows: the sets of sensors that it allows that to."""
    sets = {row["fitted"]: row["found_soonest_s"] for row in rows}
    for bound_s in sorted({bound_s for bound_s in sets.values() if bound_s is not None}):
        yield {"bound_s": bound_s, "sets": ", ".join(f"`{name}`" for name, own in sets.items() if own == bound_s)}


def _found(row: Row) -> Row:
    times = {name: [_cell("{s:.1f}", {"s": s}) for s in row[f"{name}_s"] or ()] for name in ("found", "again")}
    return {**row, **{name: " and ".join(shown) or "–" for name, shown in times.items()}}


def _lost(row: Row) -> Row:
    return {**row, "lost": ", ".join(f"{count:.0f} {reason}" for reason, count in row["dropped"].items()) or "–"}


def _at_speeds(row: Row) -> Row:
    known = "20 s of cruising" if row["speed_std_kmh"] is None else f"known to {row['speed_std_kmh']:g} km/h"
    return {**row, "known": known, **{f"at_{kmh}": std for kmh, std in row["std_percent"].items()}}


def _saved(rows: Sequence[Row]) -> Iterator[Row]:
    """Distance and time that the wet law saves against the fixed worst case, ours and the paper's, as shares."""
    fixed = {(row["from_kmh"], row["to_kmh"]): row for row in rows if row["case"] == "0.0726"}
    for law in (row for row in rows if row["case"] == "wet law"):
        worst = fixed[law["from_kmh"], law["to_kmh"]]
        names = ("distance_m", "paper_distance_m", "time_s", "paper_time_s")
        yield {**law, **{name: 1 - law[name] / worst[name] for name in names}}


def _limits(rows: Sequence[Row]) -> Iterator[Crossed]:
    """Where the emergency brake intervenes by speed and case; how much earlier the other limits of the truth are."""
    yield from (((f"{row['speed_kmh']:g}", row["case"]), _cell("{ebi_m:.0f}", row)) for row in rows)
    for row in (row for row in rows if row["case"] == rows[0]["case"]):
        for head, name in EARLIER.items():
            yield (f"{row['speed_kmh']:g}", head), f"{row[name] - row['ebi_m']:.0f}"


def _switched(row: Row) -> Row:
    before = row.get("std_before_switch")
    return {**row, "std_before_switch": before, "share": None if before is None else row["used_fraction"]}


def _noise(rows: Sequence[Row]) -> Iterator[Crossed]:
    for row in rows:
        level, _, way = str(row["experiment"]).partition(", ")
        if level.startswith("creep noise"):
            yield (level.split()[-1], way), _cell(PEAK, row)


def _coverage(shares: Mapping[str, float]) -> Iterator[Crossed]:
    for (name, _, noise), share in ((key.partition(", "), share) for key, share in shares.items()):
        yield (f"`{name}`", noise), _cell("{share:.1%}", {"share": share})


def _wrong(row: Row) -> Row:
    return {**row, "wrong": row["published"] * row["wrong_of_published"]}

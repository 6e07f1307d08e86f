# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tables of what was measured, out of doc/evidence/*.json; under each the command that made it."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from statistics import fmean

from forms import COLUMNS, Row, cell, listed
from interface_tables import table
from real_tables import real

Crossed = tuple[tuple[str, str], str]
"""Line, column and cell."""

FOLDER = Path(__file__).resolve().parent / "evidence"
MADE_BY: dict[str, dict[str, str]] = json.loads((FOLDER / "made_by.json").read_text(encoding="utf-8"))
"""Command, seeds and settings by the name of the file they made."""
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
BRIEFLY = {
    "bank": "bank, the default",
    "rail_condition": "rail condition, a method of windows",
    "particle_em": "the paper's method, here",
}
PRINTED = "the paper's method, as printed (its noise is not)"
KEPT = "lower bound kept by the bank; by the rail condition (asked: 95 %)"
CONFIDENCE = 0.99
"""Of the safe curve, by default."""
EARLIER = {"SBI": "sbi_m", "W": "warning_m", "P": "permitted_m", "I": "indication_m"}


def parts() -> dict[str, str]:
    """Return the tables by the name of their part."""
    files = {name: json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8")) for name in MADE_BY}
    robust, creep = files["robust"], files["creep"]
    rails, faults = ([row for row in robust if row["table"] == name] for name in ("rails", "faults"))
    lists: dict[str, tuple[str, Iterable[Row]]] = {
        "rails": ("robust", map(_found, rails)),
        "faults measured": ("robust", map(_lost, faults)),
        "bound": ("bound", map(_at_speeds, files["bound"])),
        "distances": ("distances", files["distances"]),
        "safety": ("safety", files["safety"]),
        "worlds": ("worlds", (row for row in files["worlds"] if row["curve_confidence"] == CONFIDENCE)),
        "calibration": ("worlds", _calibrated(files["worlds"])),
        "saved": ("distances", _saved(files["distances"])),
        "creep experiments": ("creep", (_switched(row) for row in creep if "samples" in row)),
        "creep withheld": ("creep", map(_wrong, creep[0]["withholding"])),
    }
    made = {name: (file, listed(COLUMNS[name], rows)) for name, (file, rows) in lists.items()}
    made |= {name: ("real_before" if name == "real_before" else "real", shown) for name, shown in real(files).items()}
    made["creep noise"] = "creep", _crossed("noise on λ", _noise(creep))
    made["creep coverage"] = "creep", _crossed("", _coverage(creep[0]["coverage95"]))
    made["tables briefly"] = "tables", _crossed("", _briefly(files["tables"]))
    for name, scenario in SCENARIOS.items():
        accuracy, limits = ([row for row in files[f] if row["scenario"] == name] for f in ("tables", "intervention"))
        made[f"tables {name}"] = "tables", _crossed(f"{scenario}; start", _accuracy(accuracy))
        head = f"km/h, before {limits[0]['target_kmh']:.0f} km/h"
        made[f"intervention {name}"] = "intervention", _crossed(head, _limits(limits))
    return {name: f"{shown}\n\n{_source(file)}" for name, (file, shown) in made.items()}


def _calibrated(rows: Sequence[Row]) -> Iterator[Row]:
    """By the confidence that the safe curve is asked for: how often it is long enough, and how much longer."""
    for asked in sorted({row["curve_confidence"] for row in rows}):
        own = [row for row in rows if row["curve_confidence"] == asked]
        least = min(own, key=lambda row: row["safe"])
        sound = [row["excess_percent"] for row in own if "odometer" not in row["sensors"]]
        yield {
            **{"curve_confidence": asked, "safe": fmean(row["safe"] for row in own), "least": least["safe"]},
            **{"sensors": least["sensors"], "excess_percent": fmean(sound)},
        }


def _source(file: str) -> str:
    of = MADE_BY[file]
    return f"*`{of['command']}`; {of['seeds']}; {of['settings']} (`doc/evidence/{file}.json`).*"


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
        yield (line, METHODS[method]), cell(ERROR, row)
        if method in PAPERS:
            yield (line, PAPERS[method]), cell("{paper_mean_relative_error_percent:.2f}", row)
        if start == "mean":
            converged = "never" if row["converged_kmh"] is None else f"{row['converged_kmh']:.0f} km/h"
            for name, form in COLUMNS["of all starts"]:
                yield (name, METHODS[method]), cell(form, {**row, "converged": converged})


def _briefly(rows: Sequence[Row]) -> Iterator[Crossed]:
    """Of all starts: the error by method and scenario, what the paper prints, how often the bound holds."""
    means = {(row["scenario"], row["method"]): row for row in rows if row["start_mu"] == "mean"}
    for name, scenario in SCENARIOS.items():
        yield from (((line, scenario), cell(f"{ERROR} %", means[name, method])) for method, line in BRIEFLY.items())
        yield (PRINTED, scenario), cell("{paper_mean_relative_error_percent:.2f} %", means[name, "particle_em"])
        kept = (cell("{lower_bound_holds:.1%}", means[name, method]) for method in ("bank", "rail_condition"))
        yield (KEPT, scenario), "; ".join(kept)


def _found(row: Row) -> Row:
    times = {name: [cell("{s:.1f}", {"s": s}) for s in row[f"{name}_s"] or ()] for name in ("found", "again")}
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
    yield from (((f"{row['speed_kmh']:g}", row["case"]), cell("{ebi_m:.0f}", row)) for row in rows)
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
            yield (level.split()[-1], way), cell(PEAK, row)


def _coverage(shares: Mapping[str, float]) -> Iterator[Crossed]:
    for (name, _, noise), share in ((key.partition(", "), share) for key, share in shares.items()):
        yield (f"`{name}`", noise), cell("{share:.1%}", {"share": share})


def _wrong(row: Row) -> Row:
    return {**row, "wrong": row["published"] * row["wrong_of_published"]}

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tables of `study real`: its figures, the goals, and what is possible."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from statistics import median

from forms import COLUMNS, Row, cell, listed
from interface_tables import table

from sim_node.real.sensors.fitted import FITTED

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

AT_BEST = {"error_percent": "error_least_percent", "excess_percent": "excess_least_percent"}
"""Figures of `study real` for which a bound is told, by its name."""

CAUSES = ("below the bound: the case, what is (the bound), %", "possible, and missed")

BOUGHT = ("error, %", "bound", "safe")
BESIDE = (*BOUGHT, "covers", "short, %", "false/h")
"""Columns of the real train's table that stand in the shorter ones."""

RAILS = ("wet", "leaves")
"""Scenarios in which sets of sensors are compared."""


def real(files: Mapping[str, Sequence[Row]]) -> dict[str, str]:
    """Return the tables by the name of their part, of what is and of what was before."""
    rows, before = files["real"], files["real_before"]
    nothing = dict.fromkeys(AT_BEST.values())
    heads = "figure", "goal", "met", "missed, below the bound", "missed most by"
    bought = (f"{rail}: {head}" for rail in RAILS for head in BOUGHT)
    return {
        "real": listed(COLUMNS["real"], rows, _marked),
        "real_before": listed(COLUMNS["real"], ({**nothing, **row} for row in before), _marked),
        "real soonest": listed(COLUMNS["real soonest"], _soonest(rows)),
        "real goals": table(heads, _reached(rows)),
        "real missed": table(("goal", *CAUSES), _by_cause(rows)),
        "real times": table(("over what is possible", "cases", "least", "median", "most"), _times(rows)),
        "real before and now": table(("case", *BESIDE), _beside(before, rows)),
        "real sensors": table(("sensors", *bought), _bought(rows)),
    }


def _marked(form: str, row: Row) -> str:
    """Fill in a form, bold where its figure misses its goal."""
    shown = cell(form, row)
    return f"**{shown}**" if any(f"{{{figure}:" in form for figure in row["missed"]) else shown


def _reached(rows: Sequence[Row]) -> Iterator[Sequence[str]]:
    """By goal: in how many of the cases that have a figure it is met, and where it is missed most."""
    for figure, (says, goal, form, factor) in GOALS.items():
        judged = [row for row in rows if row[figure] is not None and figure in row["goals"]]
        worst = max(judged, key=lambda row: abs(row["missed"].get(figure, 0.0)), default=None)
        by = 0.0 if worst is None else worst["missed"].get(figure, 0.0)
        met = sum(figure not in row["missed"] for row in judged)
        where = f"{form.format(by=factor * by)} ({worst['case']})" if worst is not None and by else "–"
        forbidden = str(sum(map(partial(_is_forbidden, figure), judged))) if figure in AT_BEST else "–"
        yield says, goal, f"{met} of {len(judged)}", forbidden, where


def _is_forbidden(figure: str, row: Row) -> bool:
    """Whether a goal that is missed lies below its bound."""
    least = row[AT_BEST[figure]]
    return figure in row["missed"] and least is not None and least > row["goals"][figure][1]


def _by_cause(rows: Sequence[Row]) -> Iterator[Sequence[str]]:
    """The cases that miss a goal which has a bound, each with its figure and what is possible."""
    for figure in AT_BEST:
        for limit in sorted({row["goals"][figure][1] for row in rows if figure in row["missed"]}):
            own = [row for row in rows if figure in row["missed"] and row["goals"][figure][1] == limit]
            sides = ([row for row in own if _is_forbidden(figure, row) == side] for side in (True, False))
            yield f"{figure.split('_')[0]} ≤ {limit:.0f} %", *(_with_best(figure, side) for side in sides)


def _with_best(figure: str, rows: Sequence[Row]) -> str:
    digits = 0 if figure == "excess_percent" else 1
    best = [row[AT_BEST[figure]] for row in rows]  # none of an axle that slides
    shown = ["–" if each is None else f"{each:.{digits}f}" for each in best]
    return "; ".join(f"{row['case']} {row[figure]:.{digits}f} ({each})" for row, each in zip(rows, shown, strict=True))


def _times(rows: Sequence[Row]) -> Iterator[Sequence[str]]:
    """How many times what is possible a figure is, where wheels are heard and where they are not."""
    for figure, best in AT_BEST.items():
        for sensors, heard in (("without wheels", False), ("with wheels", True)):
            own = [row for row in rows if row[figure] and row[best]]
            own = [row for row in own if ("wheels" in FITTED[row["fitted"]].sensors) == heard]
            times = sorted((row[figure] / row[best], row["case"]) for row in own)
            least, most = (f"{ratio:.2f} ({case})" for ratio, case in (times[0], times[-1]))
            middle = f"{median(ratio for ratio, _ in times):.2f}"
            yield f"{figure.split('_')[0]}, {sensors}", str(len(times)), least, middle, most


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


def _soonest(rows: Sequence[Row]) -> Iterator[Row]:
    """By what the bound allows: the sets of sensors that it allows that to."""
    sets = {row["fitted"]: row["found_soonest_s"] for row in rows}
    for bound_s in sorted({bound_s for bound_s in sets.values() if bound_s is not None}):
        yield {"bound_s": bound_s, "sets": ", ".join(f"`{name}`" for name, own in sets.items() if own == bound_s)}

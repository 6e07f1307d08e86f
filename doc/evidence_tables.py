# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Tables of what was measured, out of doc/evidence/*.json; under each the command that made it."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from interface_tables import table

Row = Mapping[str, Any]

FOLDER = Path(__file__).resolve().parent / "evidence"
MADE_BY: dict[str, dict[str, str]] = json.loads((FOLDER / "made_by.json").read_text(encoding="utf-8"))
"""Command, seeds and settings by the name of the file they made."""

SCENARIOS = {"tunnel_entry": "flat → wet tunnel, 300 → 100 km/h", "tunnel_exit": "tunnel → wet line, 250 → 50 km/h"}
METHODS = {
    "rail_condition": "rail condition",
    "particle_em": "paper's method",
    "ekf_tuned": "tuned EKF",
    "ekf_naive": "naive EKF",
}


def parts() -> dict[str, str]:
    """Return the tables by the name of their part."""
    files = {name: json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8")) for name in MADE_BY}
    made = {
        **{f"tables {scenario}": ("tables", _accuracy(files["tables"], scenario)) for scenario in SCENARIOS},
        "rails": ("robust", _rails([row for row in files["robust"] if row["table"] == "rails"])),
        "faults measured": ("robust", _faults([row for row in files["robust"] if row["table"] == "faults"])),
        "bound": ("bound", _bound(files["bound"])),
        "distances": ("distances", _distances(files["distances"])),
        "saved": ("distances", _saved(files["distances"])),
        **{f"intervention {scenario}": ("intervention", _intervention(files, scenario)) for scenario in SCENARIOS},
        "creep experiments": ("creep", _creep(files["creep"])),
        "creep noise": ("creep", _creep_noise(files["creep"])),
        "creep coverage": ("creep", _coverage(files["creep"])),
        "creep withheld": ("creep", _withheld(files["creep"])),
    }
    return {name: f"{shown}\n\n{_source(file)}" for name, (file, shown) in made.items()}


def _source(file: str) -> str:
    of = MADE_BY[file]
    return f"*`{of['command']}`; {of['seeds']}; {of['settings']} (`doc/evidence/{file}.json`).*"


def _accuracy(rows: Sequence[Row], scenario: str) -> str:
    """Mean relative error by start and method, then what holds of the mean over the starts."""
    of = {(row["method"], row["start_mu"]): row for row in rows if row["scenario"] == scenario}
    starts = [start for method, start in of if method == "rail_condition"]
    head = (f"{SCENARIOS[scenario]}; start", "rail condition", "paper's method", "paper", *list(METHODS.values())[2:])
    lines: list[tuple[str, ...]] = []
    for start in starts:
        cells = [_spread(of[method, start], "mean_relative_error_percent") for method in METHODS]
        paper = _number(of["particle_em", start]["paper_mean_relative_error_percent"], 2)
        papers_ekf = _number(of["ekf_naive", start]["paper_mean_relative_error_percent"], 2)
        shown = "**mean**" if start == "mean" else f"{start:g}"
        lines.append((shown, *cells[:2], paper, *cells[2:], papers_ekf))
    for name, show in _OF_ALL_STARTS.items():
        cells = [show(of[method, "mean"]) for method in METHODS]
        lines.append((name, *cells[:2], "", *cells[2:], ""))
    return table((*head, "paper's EKF"), lines)


_OF_ALL_STARTS: dict[str, Callable[[Row], str]] = {
    "5–95 % of the runs": lambda row: f"{row['p5_relative_error_percent']:.2f}–{row['p95_relative_error_percent']:.2f}",
    "mean error first below 5 % at": lambda row: (
        "never" if row["converged_kmh"] is None else f"{row['converged_kmh']:.0f} km/h"
    ),
    "95 % interval holds the truth": lambda row: _percent(row["coverage95"]),
    "lower bound holds (95 %)": lambda row: _percent(row["lower_bound_holds"]),
    "error beside the bound's": lambda row: f"{row['bound_ratio']:.2f}",
}


def _rails(rows: Sequence[Row]) -> str:
    head = (
        *("what the estimator does not know", "error, %", "ratio", "95 % interval covers", "bound kept", "claimed"),
        *("changes an hour", "found", "again"),
    )
    return table(head, ((*_common(row, "ratio_to_clean", "coverage95"), *_noticed(row)) for row in rows))


def _noticed(row: Row) -> tuple[str, ...]:
    found, again = (" and ".join(_number(value, 1) for value in row[name] or ()) for name in ("found_s", "again_s"))
    claimed, changes = _percent(row["claimed_while_the_brake_limits"]), _number(row["changes_per_hour"], 1)
    return claimed, changes, found or "–", again or "–"


def _faults(rows: Sequence[Row]) -> str:
    head = (
        *("fault", "error, %", "ratio to B", "90 % interval covers", "bound kept", "safe curve", "to B, σ"),
        *("rail changes", "again, s", "dropped in a run"),
    )
    return table(head, ((*_common(row, "ratio_to_b", "coverage90"), *_cost(row)) for row in rows))


def _common(row: Row, ratio: str, coverage: str) -> tuple[str, ...]:
    cells = _spread(row, "mean_relative_error_percent"), _number(row[ratio], 2), _percent(row[coverage])
    return row["case"], *cells, _percent(row["lower_bound_holds"])


def _cost(row: Row) -> tuple[str, ...]:
    dropped = ", ".join(f"{count:.0f} {reason}" for reason, count in row["dropped"].items())
    difference, again = _number(row["largest_difference_std"], 1), _number(row["full_window_again_s"], 1)
    return _percent(row["safe_curve_holds"]), difference, str(row["rail_changes"]), again, dropped or "–"


def _bound(rows: Sequence[Row]) -> str:
    after = tuple(rows[0]["std_percent"])
    head = (
        *("scenario", "position σ, m", "speed before braking", *(f"{kmh} km/h" for kmh in after), "error"),
        *("lost: mean", "half", "95 %"),
    )
    return table(head, (_bound_row(row, after) for row in rows))


def _bound_row(row: Row, after: Sequence[str]) -> tuple[str, ...]:
    known = "20 s of cruising" if row["speed_std_kmh"] is None else f"known to {row['speed_std_kmh']:g} km/h"
    lost = (_number(row["lost_kmh"][name], 1) for name in ("mean", "half", "most"))
    least = (_number(row["std_percent"][kmh], 2) for kmh in after)
    return row["scenario"], f"{row['sigma_m']:g}", known, *least, f"{row['mean_error_percent']:.2f} %", *lost


def _distances(rows: Sequence[Row]) -> str:
    shown = (
        (
            f"{row['from_kmh']} → {row['to_kmh']}",
            row["case"],
            *(f"{row[name]:.1f}" for name in ("distance_m", "paper_distance_m", "time_s", "paper_time_s")),
        )
        for row in rows
    )
    return table(("km/h", "μ", "m", "paper", "s", "paper"), shown)


def _saved(rows: Sequence[Row]) -> str:
    """Distance and time that the wet law saves against the fixed worst case, ours and the paper's."""
    of = {(row["from_kmh"], row["to_kmh"], row["case"]): row for row in rows}
    lines = []
    for start, end in dict.fromkeys((row["from_kmh"], row["to_kmh"]) for row in rows):
        law, fixed = of[start, end, "wet law"], of[start, end, "0.0726"]
        names = ("distance_m", "paper_distance_m", "time_s", "paper_time_s")
        lines.append((f"{start} → {end}", *(f"{100 * (1 - law[name] / fixed[name]):.2f} %" for name in names)))
    return table(("saved by the wet law against the fixed 0.0726, km/h", "distance", "paper", "time", "paper"), lines)


def _intervention(files: Mapping[str, Sequence[Row]], scenario: str) -> str:
    rows = [row for row in files["intervention"] if row["scenario"] == scenario]
    cases = list(dict.fromkeys(row["case"] for row in rows))
    head = (f"km/h, before {rows[0]['target_kmh']:.0f} km/h", *cases, "SBI", "W", "P", "I")
    return table(head, _limits(rows, cases))


def _limits(rows: Sequence[Row], cases: Sequence[str]) -> Iterator[tuple[str, ...]]:
    of = {(row["speed_kmh"], row["case"]): row for row in rows}
    for speed in dict.fromkeys(row["speed_kmh"] for row in rows):
        true = of[speed, cases[0]]
        earlier = (
            f"{true[name] - true['ebi_m']:.0f}" for name in ("sbi_m", "warning_m", "permitted_m", "indication_m")
        )
        yield f"{speed:g}", *(_number(of[speed, case]["ebi_m"], 0) for case in cases), *earlier


def _creep(rows: Sequence[Row]) -> str:
    shown = [row for row in rows if "samples" in row]
    head = ("experiment", "true peak", "identified", "share of the new data", "std before the switch", "samples")
    return table(head, (_experiment(row) for row in shown))


def _experiment(row: Row) -> tuple[str, ...]:
    before = f"{row['std_before_switch']:.5f}" if "std_before_switch" in row else "–"
    share = f"{100 * row['used_fraction']:.0f} %" if "std_before_switch" in row else "–"
    return str(row["experiment"]), f"{row['peak_true']:.2f}", _peak(row), share, before, str(row["samples"])


def _creep_noise(rows: Sequence[Row]) -> str:
    names = [str(row["experiment"]) for row in rows if str(row["experiment"]).startswith("creep noise")]
    of = {str(row["experiment"]): row for row in rows}
    levels = list(dict.fromkeys(name.partition(",")[0] for name in names))
    ways = list(dict.fromkeys(name.partition(", ")[2] for name in names))
    lines = [(level.split()[-1], *(_peak(of[f"{level}, {way}"]) for way in ways)) for level in levels]
    return table(("noise on λ", *ways), lines)


def _peak(row: Row) -> str:
    return f"{row['peak_estimated_mean']:.3f} ± {row['peak_estimated_std']:.3f}"


def _coverage(rows: Sequence[Row]) -> str:
    """Of experiment 1: a row for each number, a column for each kind of noise."""
    of = {tuple(name.split(", ")): share for name, share in rows[0]["coverage95"].items()}
    names, kinds = (tuple(dict.fromkeys(key[index] for key in of)) for index in (0, 1))
    return table(("", *kinds), ((f"`{name}`", *(_percent(of[name, kind]) for kind in kinds)) for name in names))


def _withheld(rows: Sequence[Row]) -> str:
    head = ("creep reached", "published", "published and wrong", "wrong if all were published")
    return table(head, (_withheld_row(row) for row in rows[0]["withholding"]))


def _withheld_row(row: Row) -> tuple[str, ...]:
    wrong = row["published"] * row["wrong_of_published"]
    return f"{row['creep_reached']:g}", *(_percent(share) for share in (row["published"], wrong, row["wrong_of_all"]))


def _spread(row: Row, name: str) -> str:
    spread = row[name.replace("mean_", "std_")]
    return "–" if row[name] is None else f"{row[name]:.2f} ± {spread:.2f}"


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.1f} %"


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"

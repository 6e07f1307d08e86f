# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The report as one HTML page: findings, charts with a slider, drops, diagnostics, parameters and versions."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from html import escape
from typing import Any

from ...web import as_json, page
from ...wire.settings.nodes import SETTINGS
from ..found.distances import FIXED_MU
from ..found.events import events
from ..found.findings import findings
from ..read.numbers import listed
from ..read.run import Run
from .creep import creep_in_words
from .page_data import Subject, chart_data
from .parts import table_html, value_or, versions
from .table import NO_ROWS, rows, shown

LITTLE = "it limited for less than 30 km/h, or a weaker brake would look the same"

MOST_TIMES = 6
"""Times that are listed of one finding."""

CALENDAR = 2000
"""Stamps before this year are those of a simulation."""

MOST_CHANGES = 200
"""Lines of a list of changes; the rest is counted."""

_Write = Callable[[Mapping[str, Any], Subject], str]

FINDINGS: tuple[tuple[str, _Write], ...] = (
    ("Train", lambda f, s: escape(s.train)),
    ("Estimates", lambda f, s: escape(s.source)),
    ("Recorded", lambda f, s: _recorded(s.run)),
    ("Duration", lambda f, s: f"{f['seconds']:.0f} s"),
    ("Brakings", lambda f, s: str(len(f["brakings"]))),
    ("Speed", lambda f, s: f"{f['from_kmh']:.0f} → {f['to_kmh']:.0f} km/h"),
    ("Adhesion identified", lambda f, s: escape(_identified(f))),
    ("Lower bound of μ kept", lambda f, s: _kept(f) + _confidence(s)),
    ("Changes of the rail found", lambda f, s: _times(f["changes_s"])),
    ("Interventions of the ATP monitor", lambda f, s: _interventions(f, s.run)),
    ("Peak of the creep curve", lambda f, s: escape(creep_in_words(s.run.creep))),
    ("Mean relative error while adhesion limits", lambda f, s: value_or(f["mean_relative_error_percent"], "{:.2f} %")),
    ("Messages not used", lambda f, s: escape(listed(f["dropped"]) or "none")),
)
"""Lines of the table of findings: their names and how they are written."""


def report_page(title: str, subjects: Sequence[Subject], target_kmh: float, parameters: Mapping[str, Any]) -> str:
    """Return the page. `parameters` are the settings that were given; all others have their defaults.

    Raises ValueError when a recorded number is not finite.
    """
    runs = [chart_data(subject, target_kmh) for subject in subjects]
    subtitle = (
        f"Wheel–rail adhesion and emergency braking to {target_kmh:g} km/h, beside the fixed worst case "
        f"μ\u00a0=\u00a0{FIXED_MU}. Distances are those of the braking curves; without a curve μ keeps its value. "
        "Bands: nothing is claimed (grey), the brake limits (blue), the adhesion limits (orange). Drag or turn the "
        "wheel over a chart to zoom, Shift and drag or the arrows to move, a double click or 0 to see all; a click "
        "moves the present."
    )
    details = (
        _section("Events", subjects, _events),
        _section("Distances", subjects, lambda subject: _distances(subject, target_kmh)),
        _section("Diagnostics", subjects, _diagnostics),
        _parameters(parameters),
        versions(),
    )
    return page(
        "report",
        title=escape(title),
        data=as_json({"runs": runs, "target_kmh": target_kmh, "fixed_mu": FIXED_MU}),
        subtitle=escape(subtitle),
        findings=_findings(subjects, target_kmh),
        details="\n".join(details),
    )


def _findings(subjects: Sequence[Subject], target_kmh: float) -> str:
    found = {subject.name: findings(subject.run, subject.config, target_kmh) for subject in subjects}
    body = ([escape(name), *map(write, found.values(), subjects)] for name, write in FINDINGS)
    brakings = "".join(f"<section><h3>{escape(name)}</h3>{_brakings(each)}</section>" for name, each in found.items())
    note = f"<p class='soft'>Distances are those to {target_kmh:g} km/h. A button shows the braking in the charts.</p>"
    return table_html(["finding", *map(escape, found)], body) + f"<h2>Brakings</h2>{note}{brakings}"


def _identified(found: Mapping[str, Any]) -> str:
    shown = sum(row["mu_low"] is not None for row in found["brakings"])
    return f"in {shown} of {len(found['brakings'])} brakings" if shown else f"not identified: {found['why'] or LITTLE}"


def _kept(found: Mapping[str, Any]) -> str:
    if found["bound_kept_percent"] is None:
        return "not known: no truth recorded"
    return f"{found['bound_kept_percent']:.1f} % of {found['bound_compared']} estimates under the brake"


def _times(seconds: Sequence[float]) -> str:
    return f"{len(seconds)}: at {', '.join(f'{at:.1f}' for at in seconds[:MOST_TIMES])} s" if seconds else "none"


def _interventions(found: Mapping[str, Any], run: Run) -> str:
    if not run.levels.t_ns.size:
        return "not recorded"
    told = [f"{each['level'].replace('_', ' ').lower()} at {each['s']:.1f} s" for each in found["interventions"]]
    return escape(f"{len(told)}: {', '.join(told[:MOST_TIMES])}" if told else "none")


def _recorded(run: Run) -> str:
    begun = datetime.fromtimestamp(run.origin_ns * 1e-9, UTC)
    return "at a simulated time" if begun.year < CALENDAR else f"{begun:%Y-%m-%d %H:%M:%S} UTC"


def _brakings(found: Mapping[str, Any]) -> str:
    """A row for each braking, whose button shows its first identified or first moment."""
    header = ("from", "km/h", "limited by", "μ̂ identified", "else μ ≥", "at least, at the end", "bound kept")
    claims = ("rail changed", "fixed worst case", "saved at least, by every later safe curve")
    body = ([_jump(row), *(escape(cell) for cell in _told(row))] for row in found["brakings"])
    return table_html([*header, *claims], body) if found["brakings"] else "<p>The train did not brake.</p>"


def _jump(row: Mapping[str, Any]) -> str:
    span = f'data-from="{row["start_s"]:.2f}" data-to="{row["end_s"]:.2f}"'
    return f'<button type="button" {span}>{row["start_s"]:.1f} s</button>'


def _told(row: Mapping[str, Any]) -> Iterator[str]:
    yield f"{row['from_kmh']:.0f}\u00a0→\u00a0{row['to_kmh']:.0f}"
    shares = (("adhesion", row["adhesion_share"]), ("the brake", row["brake_share"]))
    yield ", ".join(f"{name} {share:.0%}" for name, share in shares if share) or "nothing is claimed"
    yield "–" if row["mu_low"] is None else f"{row['mu_low']:.4f} to {row['mu_high']:.4f}"
    yield value_or(row["mu_at_least"], "{:.4f}")
    yield value_or(row["mu_lower"], "{:.4f}")
    yield value_or(row["bound_kept_percent"], "{:.1f} %")
    yield _times(row["changes_s"])
    yield "–" if row["fixed_m"] is None else f"{row['fixed_m']:.0f} m from {row['identified_at_kmh']:.0f} km/h"
    saved, fixed = row["saved_at_least_m"], row["fixed_m"]
    if saved is None:
        yield "–"
    else:
        yield f"{saved:.0f} m ({saved / fixed:.0%})" if saved > 0.0 else f"nothing: {-saved:.0f} m more are needed"


def _confidence(subject: Subject) -> str:
    confidence = subject.run.confidence
    return " (confidence not recorded)" if confidence is None else f" ({confidence:.0%} confidence)"


def _section(title: str, subjects: Sequence[Subject], write: Callable[[Subject], str]) -> str:
    columns = "".join(f"<section><h3>{escape(subject.name)}</h3>{write(subject)}</section>" for subject in subjects)
    return f'<h2>{escape(title)}</h2><div class="columns">{columns}</div>'


def _distances(subject: Subject, target_kmh: float) -> str:
    header = ["km/h", "μ true", "μ̂", "at least", "true m", "by μ̂ m", "safe m", f"fixed {FIXED_MU} m"]
    body = list(rows(subject.run, target_kmh, subject.config.train, "–"))
    return table_html(shown(subject.run, header), body, "number") if body else f"<p>{escape(NO_ROWS)}</p>"


def _diagnostics(subject: Subject) -> str:
    counts = subject.run.counts.items()
    return table_html(["value", "last"], ([escape(key), f"<code>{escape(value)}</code>"] for key, value in counts))


def _events(subject: Subject) -> str:
    run, found = subject.run, events(subject.run)
    told = [((t_ns - run.origin_ns) * 1e-9, kind, escape(text)) for t_ns, kind, text in found[:MOST_CHANGES]]
    body = [[f"{at_s:.1f}\u00a0s", kind, text] for at_s, kind, text in told]
    more = f"<p>and {len(found) - MOST_CHANGES} more</p>" if len(found) > MOST_CHANGES else ""
    return (table_html(["time", "kind", "what"], body) + more) if body else "<p>None recorded.</p>"


def _parameters(given: Mapping[str, Any]) -> str:
    """The given settings in sight, all of them on demand."""
    changed = ", ".join(f"<code>{escape(f'{name} = {value}')}</code>" for name, value in given.items())
    body = (
        [f"<code>{s.name}</code>", escape(str(given.get(s.name, s.default))), escape(s.unit), escape(s.description)]
        for s in SETTINGS
    )
    return (
        f"<h2>Parameters</h2><p>{changed or 'All at their defaults.'} A recording does not hold the parameters of the "
        "estimator that ran beside it; forces and the fixed worst case take the train from here.</p>"
        f"<details><summary>All parameters</summary>{table_html(['name', 'value', 'unit', 'meaning'], body)}</details>"
    )

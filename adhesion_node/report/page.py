# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The report as one HTML page: findings, charts with a slider, drops, diagnostics, parameters and versions."""

import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ..web import as_json, page
from ..wire.settings import SETTINGS
from .curves import Subject, chart_data
from .findings import findings, listed
from .run import FIXED_MU, Run
from .series import Series
from .table import NO_ROWS, rows, shown

LITTLE = "it limited for less than 30 km/h, or a weaker brake would look the same"

MOST_CHANGES = 40
"""Lines of a list of changes; the rest is counted."""

_Write = Callable[[Mapping[str, Any], Subject], str]

FINDINGS: tuple[tuple[str, _Write], ...] = (
    ("Train", lambda f, s: escape(s.train)),
    ("Estimates", lambda f, s: escape(s.source)),
    ("Duration", lambda f, s: f"{f['seconds']:.0f} s"),
    ("Speed", lambda f, s: f"{f['from_kmh']:.0f} → {f['to_kmh']:.0f} km/h"),
    ("Adhesion identified at", lambda f, s: escape(_identified(f))),
    ("μ̂ there", lambda f, s: _value(f["mu"], "{:.4f}")),
    ("at least", lambda f, s: _value(f["mu_lower"], "{:.4f}") + _confidence(s)),
    ("Braking distance by the fixed worst case", lambda f, s: _value(f["fixed_m"], "{:.0f} m")),
    ("saved by the identified μ̂", lambda f, s: _saved(f, "saved_m")),
    ("saved at least", lambda f, s: _saved(f, "saved_at_least_m") + _confidence(s)),
    ("Mean relative error while adhesion limits", lambda f, s: _value(f["mean_relative_error_percent"], "{:.2f} %")),
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
        "Bands: nothing is claimed (grey), the brake limits (blue), the adhesion limits (orange)."
    )
    details = (
        _section("Distances", subjects, lambda subject: _distances(subject, target_kmh)),
        _section("Drops and diagnostics", subjects, _diagnostics),
        _parameters(parameters),
        _versions(),
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
    found = [findings(subject.run, subject.config, target_kmh) for subject in subjects]
    body = ([escape(name), *map(write, found, subjects)] for name, write in FINDINGS)
    return _table(["", *(escape(subject.name) for subject in subjects)], body)


def _value(value: float | None, form: str, absent: str = "–") -> str:
    return absent if value is None else form.format(value)


def _identified(found: Mapping[str, Any]) -> str:
    return _value(found["identified_at_kmh"], "{:.0f} km/h", f"not identified: {found['why'] or LITTLE}")


def _saved(found: Mapping[str, Any], name: str) -> str:
    if found[name] is None or not found["fixed_m"]:
        return "–"
    return f"{found[name]:.0f} m ({100 * found[name] / found['fixed_m']:.1f} %)"


def _confidence(subject: Subject) -> str:
    confidence = subject.run.confidence
    return " (confidence not recorded)" if confidence is None else f" ({confidence:.0%} confidence)"


def _section(title: str, subjects: Sequence[Subject], write: Callable[[Subject], str]) -> str:
    columns = "".join(f"<section><h3>{escape(subject.name)}</h3>{write(subject)}</section>" for subject in subjects)
    return f'<h2>{escape(title)}</h2><div class="columns">{columns}</div>'


def _distances(subject: Subject, target_kmh: float) -> str:
    header = ["km/h", "μ true", "μ̂", "at least", "true m", "by μ̂ m", "by bound m", f"fixed {FIXED_MU} m"]
    body = list(rows(subject.run, target_kmh, subject.config.train, "–"))
    return _table(shown(subject.run, header), body, "number") if body else f"<p>{escape(NO_ROWS)}</p>"


def _diagnostics(subject: Subject) -> str:
    run = subject.run
    counts = _table(["", ""], ([escape(key), f"<code>{escape(value)}</code>"] for key, value in run.counts.items()))
    return counts + _changes(run, "The estimator said", run.remarks) + _changes(run, "The ATP monitor said", run.levels)


def changes(series: Series) -> list[tuple[int, str]]:
    """Times and texts at which a series of texts changes, the first included; "" is left out."""
    rows = zip(series.t_ns.tolist(), map(str, series.values), ["", *map(str, series.values)], strict=False)
    return [(t_ns, text) for t_ns, text, before in rows if text not in ("", before)]


def _changes(run: Run, title: str, series: Series) -> str:
    found = changes(series)
    body = [[f"{(t_ns - run.origin_ns) * 1e-9:.1f} s", escape(text)] for t_ns, text in found[:MOST_CHANGES]]
    more = f"<p>and {len(found) - MOST_CHANGES} more changes</p>" if len(found) > MOST_CHANGES else ""
    return (_table([title, ""], body) + more) if body else ""


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
        f"<details><summary>All parameters</summary>{_table(['name', 'value', 'unit', 'meaning'], body)}</details>"
    )


def _versions() -> str:
    names = ("adhesion_node", "numpy", "scipy")
    listed = [f"{name} {_version(name)}" for name in names] + [f"Python {platform.python_version()}"]
    return f"<h2>Versions</h2><p>{escape(', '.join(listed))}</p>"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:  # run from the source tree
        return "not installed"


def _table(header: Sequence[str], body: Iterable[Sequence[str]], kind: str = "") -> str:
    """A table of cells that are HTML already."""
    of_kind = f' class="{kind}"' if kind else ""
    head = "".join(f"<th{of_kind}>{cell}</th>" for cell in header)
    lines = "".join("<tr>" + "".join(f"<td{of_kind}>{cell}</td>" for cell in row) + "</tr>" for row in body)
    return f'<div class="scroll"><table><tr>{head}</tr>{lines}</table></div>'

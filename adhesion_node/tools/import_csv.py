# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Turns a CSV log into a recording: one row becomes a position and, where given, a brake pressure and a speed."""

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from ..bag import BagWriter, encode
from ..command.options import DONE, FAILED, help_texts, json_option, progress, report, run_tool
from ..wire import topics
from ..wire.settings import AMBIENT
from . import csv_rows
from .csv_rows import Format, Refusal, Row

EXAMPLES = (
    "import_csv log.csv --output my_run",
    "import_csv log.csv --output my_run --time t --time-unit ms --position km --position-unit km",
    "import_csv log.csv --output my_run --pressure bc_bar --pressure-unit bar --pressure-kind gauge",
)

OUTCOME = """\
Exit code 0: every row was good. 1: some rows were refused, each with a line on standard error; the others are in
the recording. 2: nothing was written (bad usage, missing column, no good row).
A time without zone is UTC. Equal logs give equal recordings, byte by byte."""


def main(args: Sequence[str] | None = None) -> int:
    """Run `import_csv FILE --output DIR`."""
    texts = help_texts(__doc__, *EXAMPLES, more=OUTCOME)
    parser = argparse.ArgumentParser("import_csv", parents=[json_option()], **texts)
    add = parser.add_argument
    add("file", metavar="FILE", help="the log: a header line, then one row per time")
    add("--output", metavar="DIR", required=True, help="the recording, a new directory")
    for column in (*csv_rows.REQUIRED, *csv_rows.OPTIONAL):
        add(csv_rows.option(column), dest=column, metavar="COL", help=f"name of the column, when not {column!r}")
    add("--delimiter", default=",", help="between two cells, \\t for a tab (default: ,)")
    add("--time-unit", choices=list(csv_rows.TIME_UNITS), default="s", help="default: s")
    add("--position-unit", choices=list(csv_rows.POSITION_UNITS), default="m", help="default: m; variance is in m^2")
    std = "where there is no variance (default: 0.5)"
    add("--position-std", dest="position_std_m", type=float, default=0.5, metavar="M", help=std)
    add("--pressure-unit", choices=list(csv_rows.PRESSURE_UNITS), default="pa", help="default: pa")
    add("--pressure-kind", choices=["gauge", "absolute"], default="gauge", help="default: gauge")
    air = f"of the air, which a gauge pressure is above; give the estimator the same as {AMBIENT.name}"
    air += f" (default: {AMBIENT.default:g})"
    add("--ambient-pressure", dest=AMBIENT.name, type=float, default=AMBIENT.default, metavar="PA", help=air)
    add("--speed-unit", choices=list(csv_rows.SPEED_UNITS), default="mps", help="default: mps")
    return run_tool(parser, _work, args)


def convert(source: Path, output: Path, form: Format) -> dict[str, Any]:
    """Write the rows of a log into a new recording and return the summary; a line on stderr for every bad row.

    Raises ValueError, and leaves nothing behind, when the output exists, a column is missing or no row is good.
    """
    if not source.is_file():
        raise ValueError(f"file = {source}: is no file: name a CSV log")
    # A broken byte must not end the import: it becomes a character that no number has.
    with source.open(encoding="utf-8-sig", errors="replace") as file:
        rows = csv_rows.read_rows(file, str(source), form)
        writer = BagWriter(output)
        try:
            summary = _write(rows, writer, form)
            if not summary["written"]:
                raise ValueError(f"{source}: no good row in {summary['rows']}: nothing was written")
            writer.close()
        except BaseException:
            writer.discard()
            raise
    return summary


def _write(rows: Iterable[Row | Refusal], writer: BagWriter, form: Format) -> dict[str, Any]:
    refused: Counter[str] = Counter()
    empty: Counter[str] = Counter()
    written = 0
    for row in progress(rows, "rows"):
        if isinstance(row, Refusal):
            refused[row.reason] += 1
            print(row.message, file=sys.stderr)
            continue
        written += 1
        variance_m2 = form.position_std_m**2 if row.variance_m2 is None else row.variance_m2
        for topic, value, variance in (  # the position last, as in a live run
            (topics.BRAKE_PRESSURE, row.absolute_pa, 0.0),
            (topics.SPEED, row.speed_mps, 0.0),
            (topics.POSITION, row.position_m, variance_m2),
        ):
            if value is not None:
                writer.write(f"/{topic.name}", topic.type, encode(topic, row.t_ns, (value,), variance), row.t_ns)
        optional = zip(csv_rows.OPTIONAL, (row.variance_m2, row.absolute_pa, row.speed_mps), strict=True)
        empty.update(column for column, value in optional if value is None)
    return {
        "rows": written + refused.total(),
        "written": written,
        "refused": dict(sorted(refused.items())),
        "empty": dict(sorted(empty.items())),
        "messages": writer.counts,
        "output": str(writer.path),
    }


def _work(options: argparse.Namespace) -> int:
    given = vars(options)
    names = {column: given[column] for column in (*csv_rows.REQUIRED, *csv_rows.OPTIONAL) if given[column] is not None}
    given |= {"named": names, "pressure_is_gauge": options.pressure_kind == "gauge"}
    given["delimiter"] = options.delimiter.replace("\\t", "\t")
    form = Format(**{field.name: given[field.name] for field in fields(Format)})
    summary = convert(Path(options.file), Path(options.output), form)
    lines = [f"{summary['rows']} rows, {summary['written']} written to {summary['output']}"]
    lines += [f"{count} refused: {reason}" for reason, count in summary["refused"].items()]
    lines += [f"{count} without {column}" for column, count in summary["empty"].items()]
    report(options.json, summary, "\n".join(lines))
    return FAILED if summary["refused"] else DONE

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Turns a CSV log into a recording: one row becomes a position and, where given, a brake pressure and a speed."""

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
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
    return run_tool(_parser(), _work, args)


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
        empty.update(_write_row(row, writer, form))
        written += 1
    return {
        "rows": written + refused.total(),
        "written": written,
        "refused": dict(sorted(refused.items())),
        "empty": dict(sorted(empty.items())),
        "messages": writer.counts,
        "output": str(writer.path),
    }


def _write_row(row: Row, writer: BagWriter, form: Format) -> list[str]:
    """Write the messages of a row, the position last as in a live run; return what the row does not have."""
    variance_m2 = form.position_std_m**2 if row.variance_m2 is None else row.variance_m2
    for topic, value, variance in (
        (topics.BRAKE_PRESSURE, row.absolute_pa, 0.0),
        (topics.SPEED, row.speed_mps, 0.0),
        (topics.POSITION, row.position_m, variance_m2),
    ):
        if value is not None:
            writer.write(f"/{topic.name}", topic.type, encode(topic, row.t_ns, (value,), variance), row.t_ns)
    optional = zip(csv_rows.OPTIONAL, (row.variance_m2, row.absolute_pa, row.speed_mps), strict=True)
    return [column for column, value in optional if value is None]


def _work(options: argparse.Namespace) -> int:
    summary = convert(Path(options.file), Path(options.output), _form(options))
    report(options.json, summary, _text(summary))
    return FAILED if summary["refused"] else DONE


def _text(summary: dict[str, Any]) -> str:
    lines = [f"{summary['rows']} rows, {summary['written']} written to {summary['output']}"]
    lines += [f"{count} refused: {reason}" for reason, count in summary["refused"].items()]
    lines += [f"{count} without {column}" for column, count in summary["empty"].items()]
    return "\n".join(lines)


def _form(options: argparse.Namespace) -> Format:
    named = {column: getattr(options, column) for column in (*csv_rows.REQUIRED, *csv_rows.OPTIONAL)}
    return Format(
        named={column: name for column, name in named.items() if name is not None},
        delimiter=options.delimiter.replace("\\t", "\t"),
        time_unit=options.time_unit,
        position_unit=options.position_unit,
        position_std_m=options.position_std,
        pressure_unit=options.pressure_unit,
        pressure_is_gauge=options.pressure_kind == "gauge",
        ambient_pressure_pa=options.ambient_pressure,
        speed_unit=options.speed_unit,
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "import_csv", parents=[json_option()], **help_texts(__doc__, *EXAMPLES, more=OUTCOME)
    )
    add = parser.add_argument
    add("file", metavar="FILE", help="the log: a header line, then one row per time")
    add("--output", metavar="DIR", required=True, help="the recording, a new directory")
    for column in (*csv_rows.REQUIRED, *csv_rows.OPTIONAL):
        add(csv_rows.option(column), dest=column, metavar="COL", help=f"name of the column, when not {column!r}")
    add("--delimiter", default=",", help="between two cells, \\t for a tab (default: ,)")
    add("--time-unit", choices=list(csv_rows.TIME_UNITS), default="s", help="default: s")
    add("--position-unit", choices=list(csv_rows.POSITION_UNITS), default="m", help="default: m; variance is in m^2")
    add("--position-std", type=float, default=0.5, metavar="M", help="where there is no variance (default: 0.5)")
    add("--pressure-unit", choices=list(csv_rows.PRESSURE_UNITS), default="pa", help="default: pa")
    add("--pressure-kind", choices=["gauge", "absolute"], default="gauge", help="default: gauge")
    add(
        "--ambient-pressure",
        type=float,
        default=AMBIENT.default,
        metavar="PA",
        help=f"of the air, which a gauge pressure is above; give the estimator the same as {AMBIENT.name} "
        f"(default: {AMBIENT.default:g})",
    )
    add("--speed-unit", choices=list(csv_rows.SPEED_UNITS), default="mps", help="default: mps")
    return parser

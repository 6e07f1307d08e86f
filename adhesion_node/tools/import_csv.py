# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Turns a CSV log into a recording: one row becomes the messages of all that was measured at its time."""

import argparse
import math
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from ..bag import BagWriter, encode
from ..command.options import DONE, FAILED, help_texts, json_option, progress, report, run_tool
from ..core.physics.train import CRH3
from ..wire import topics
from ..wire.settings import AMBIENT
from ..wire.topics import Topic
from . import csv_cells, csv_format, csv_rows
from .csv_format import Format
from .csv_rows import Refusal, Row

EXAMPLES = (
    "import_csv log.csv --output my_run",
    "import_csv log.csv --output my_run --time t --time-unit ms --position km --position-unit km",
    "import_csv log.csv --output my_run --pressure bc_bar --pressure-unit bar --pressure-kind gauge",
    "import_csv log.csv --output my_run --lat lat --lon lon --wheel-speeds axle1 axle4 --wheel-unit kmh",
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
    for column in ("time", *csv_rows.OPTIONAL):
        add(csv_rows.option(column), dest=column, metavar="COL", help=f"name of the column, when not {column!r}")
    axles = "names of the columns of the axles, the first one first, when not 'wheel_speed_1' and so on"
    add("--wheel-speeds", dest="axles", metavar="COL", nargs="+", action="extend", default=[], help=axles)
    add("--delimiter", default=",", help="between two cells, \\t for a tab (default: ,)")
    add("--time-unit", choices=list(csv_cells.TIME_UNITS), default="s", help="default: s")
    add("--position-unit", choices=list(csv_format.POSITION_UNITS), default="m", help="default: m; variance is in m^2")
    std = "of all positions, where there is no variance (default: 0.5; of latitude and longitude: unknown)"
    add("--position-std", dest="position_std_m", type=float, metavar="M", help=std)
    add("--pressure-unit", choices=list(csv_format.PRESSURE_UNITS), default="pa", help="default: pa")
    add("--pressure-kind", choices=["gauge", "absolute"], default="gauge", help="default: gauge")
    air = f"of the air, which a gauge pressure is above; give the estimator the same as {AMBIENT.name}"
    air += f" (default: {AMBIENT.default:g})"
    add("--ambient-pressure", dest=AMBIENT.name, type=float, default=AMBIENT.default, metavar="PA", help=air)
    add("--speed-unit", choices=list(csv_format.SPEED_UNITS), default="mps", help="default: mps")
    add("--acceleration-unit", choices=list(csv_format.ACCELERATION_UNITS), default="mps2", help="default: mps2")
    add("--wheel-unit", choices=csv_format.WHEEL_UNITS, default="radps", help="default: radps; mps and kmh: of the rim")
    radius_m = CRH3.wheel_radius_m
    radius = f"of the wheels, for those (default: {radius_m:g})"
    add("--wheel-radius", dest="wheel_radius_m", type=float, default=radius_m, metavar="M", help=radius)
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
        empty.update(row.empty)
        for topic, numbers, variance in _messages(row, form):
            writer.write(f"/{topic.name}", topic.type, encode(topic, row.t_ns, numbers, variance), row.t_ns)
    return {
        "rows": written + refused.total(),
        "written": written,
        "refused": dict(sorted(refused.items())),
        "empty": dict(sorted(empty.items())),
        "messages": writer.counts,
        "output": str(writer.path),
    }


def _messages(row: Row, form: Format) -> Iterator[tuple[Topic, Sequence[float], float]]:
    """Yield the topics of a row with their numbers and variance, 0 where unknown; the position last, as in a run."""
    values, std = row.values, form.position_std_m
    for topic, column, variance in (
        (topics.BRAKE_PRESSURE, "brake_pressure", 0.0),
        (topics.BRAKE_DEMAND, "brake_demand", 0.0),
        (topics.SPEED, "speed", values.get("speed_std", 0.0) ** 2),
        (topics.IMU, "acceleration", 0.0),
    ):
        if column in values:
            yield topic, (values[column],), variance
    if row.axles_radps:
        yield topics.WHEEL_SPEED, row.axles_radps, 0.0
    if "lat" in values:
        place = values["lat"], values["lon"], values.get("height", math.nan)
        yield topics.FIX, place, values.get("variance", (std or 0.0) ** 2)
    if "position" in values:
        yield topics.POSITION, (values["position"],), values.get("variance", (0.5 if std is None else std) ** 2)


def _work(options: argparse.Namespace) -> int:
    given = vars(options)
    names = {column: given[column] for column in ("time", *csv_rows.OPTIONAL) if given[column] is not None}
    given |= {"named": names, "pressure_is_gauge": options.pressure_kind == "gauge"}
    given["delimiter"] = options.delimiter.replace("\\t", "\t")
    form = Format(**{field.name: given[field.name] for field in fields(Format)})
    summary = convert(Path(options.file), Path(options.output), form)
    lines = [f"{summary['rows']} rows, {summary['written']} written to {summary['output']}"]
    lines += [f"{count} refused: {reason}" for reason, count in summary["refused"].items()]
    lines += [f"{count} without {column}" for column, count in summary["empty"].items()]
    report(options.json, summary, "\n".join(lines))
    return FAILED if summary["refused"] else DONE

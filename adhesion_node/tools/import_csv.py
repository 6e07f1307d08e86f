# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Turns a CSV log into a recording: one row becomes the messages of all that was measured at its time."""

import argparse
import math
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..bag import BagWriter, encode
from ..command.options import DONE, FAILED, help_texts, json_option, progress, report, run_tool
from ..wire import topics
from ..wire.topic import Topic
from .log.format import Format
from .log.odd.checks import odd
from .log.options import add_options, format_of
from .log.text import BLOCK
from .log.told import Refused, ranges, read_as, units_read
from .log.whole.read import Log, read_log

EXAMPLES = (
    "import_csv log.csv --dry-run",
    "import_csv log.csv --output my_run --time t --time-unit ms --position km --position-unit km",
    "import_csv log.csv --output my_run --pressure bc_bar --pressure-unit bar --pressure-kind gauge",
    "import_csv log.csv --output my_run --lat lat --lon lon --wheel-speeds axle1 axle4 --wheel-unit kmh",
    "import_csv log.csv --output my_run --time Zeit --time-zone Europe/Berlin --speed v --speed-unit kmh --pipe HL_bar "
    "--pressure-unit bar",
)

OUTCOME = """\
Exit code 0: every row was good. 1: some rows were refused, or the data are odd, which standard error says with the
option that cures it; the good rows are in the recording. Or reading or writing failed, or Ctrl-C: then there is no
recording, nor behind SIGTERM (143). 2: nothing was written (bad usage, missing column, no good row). A time without
zone is UTC. Equal logs give equal recordings, byte by byte."""

SHOWN = 5
"""Rows of --dry-run."""


def main(args: Sequence[str] | None = None) -> int:
    """Run `import_csv FILE --output DIR`."""
    texts = help_texts(__doc__, *EXAMPLES, more=OUTCOME)
    parser = argparse.ArgumentParser("import_csv", parents=[json_option()], **texts)
    add = parser.add_argument
    add("file", metavar="FILE", help="the log: a header line, then one row per time; text, or .parquet")
    add("--output", metavar="DIR", help="the recording, a new directory")
    add(
        "--dry-run",
        action="store_true",
        help="show the first rows as they are understood and what is odd; write nothing",
    )
    add_options(parser)
    return run_tool(parser, _work, args)


def read(source: Path, form: Format) -> tuple[Log, Counter[str]]:
    """Read a log; what is refused and what is odd is said on stderr.

    Raises ValueError when a column is missing or no row is good, or an option means nothing.
    """
    if not source.is_file():
        raise ValueError(f"file = {source}: is no file: name a CSV log; what comes by a pipe, save in one first")
    refused = Refused()
    log = read_log(source, form, refused.tell)
    refused.end()
    if log.rows.empty:
        raise ValueError(f"{source}: no good row in {refused.counts.total()}: nothing was written; {read_as(log.form)}")
    return log, refused.counts


def convert(source: Path, output: Path, form: Format) -> tuple[Log, dict[str, Any]]:
    """Write the rows of a log into a new recording; return it with its summary.

    Raises ValueError, and leaves nothing behind, when the output exists, a column is missing or no row is good.
    """
    log, refused = read(source, form)
    writer = BagWriter(output)
    try:
        _write(log, writer)
        writer.close()
    except BaseException:
        writer.discard()
        raise
    return log, {**_summary(log, refused), "messages": writer.counts, "output": str(writer.path)}


def _summary(log: Log, refused: Counter[str]) -> dict[str, Any]:
    empty = {name: count for name, count in log.rows.isna().sum().sort_index().items() if count}
    return {
        "rows": len(log.rows) + refused.total(),
        "written": len(log.rows),
        "refused": dict(sorted(refused.items())),
        "empty": {str(name): int(count) for name, count in empty.items()},
        "odd": odd(log),
    }


def _write(log: Log, writer: BagWriter) -> None:
    axles, topics_of = list(log.columns.axles), [name for name in log.rows if name not in ("t_ns", *log.columns.axles)]
    for row in progress(_rows(log), "rows", len(log.rows)):
        values = {name: row[name] for name in topics_of if not math.isnan(row[name])}
        wheels = tuple(row[name] for name in axles)
        for topic, numbers, variance in _messages(values, wheels, log.stds):
            writer.write(f"/{topic.name}", topic.type, encode(topic, row["t_ns"], numbers, variance), row["t_ns"])


def _rows(log: Log) -> Iterator[dict[str, Any]]:
    for first in range(0, len(log.rows), BLOCK):
        yield from log.rows.iloc[first : first + BLOCK].to_dict("records")


def _messages(
    values: Mapping[str, float], wheels: Sequence[float], stds: Mapping[str, float]
) -> Iterator[tuple[Topic, Sequence[float], float]]:
    """Yield the topics of a row with their numbers and variance, 0 where unknown; the position last, as in a run."""
    for topic, column, variance in (
        (topics.BRAKE_PRESSURE, "brake_pressure", 0.0),
        (topics.BRAKE_DEMAND, "brake_demand", 0.0),
        (topics.SPEED, "speed", values.get("speed_std", stds["speed"]) ** 2),
        (topics.IMU, "acceleration", 0.0),
    ):
        if column in values:
            yield topic, (values[column],), variance
    if not all(map(math.isnan, wheels)):
        yield topics.WHEEL_SPEED, wheels, 0.0
    if "lat" in values:
        place = values["lat"], values["lon"], values.get("height", math.nan)
        yield topics.FIX, place, values.get("variance", stds["fix"] ** 2)
    if "position" in values:
        yield topics.POSITION, (values["position"],), values.get("variance", stds["position"] ** 2)


def _work(options: argparse.Namespace) -> int:
    form = format_of(options)
    if options.dry_run:
        log, refused = read(Path(options.file), form)
        summary = {**_summary(log, refused), "written": 0}
        lines = ["the first rows, in SI, pressures absolute:", log.rows.head(SHOWN).rename_axis("line").to_string()]
    elif options.output:
        log, summary = convert(Path(options.file), Path(options.output), form)
        lines = [f"{summary['rows']} rows, {summary['written']} written to {summary['output']}"]
    else:
        raise ValueError("output: name the recording with --output DIR, or look first with --dry-run")
    lines += [read_as(log.form), *units_read(log.form), *log.notes, *ranges(log)]
    lines += [f"{count} refused: {reason}" for reason, count in summary["refused"].items()]
    lines += [f"{count} without {column}" for column, count in summary["empty"].items()]
    for text in summary["odd"]:
        print(f"import_csv: odd: {text}", file=sys.stderr)
    report(options.json, summary, "\n".join(lines))
    return FAILED if summary["refused"] or summary["odd"] else DONE


if __name__ == "__main__":
    sys.exit(main())

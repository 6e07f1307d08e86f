# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`report BAG`: what a recording shows, as one HTML page that needs no network, and as PNG and PDF pictures.

A recording that holds the results of the estimator is shown as recorded; of one that holds sensor messages alone the
results are estimated first, with --set and --params. Several recordings stand side by side. Of tables that `brakings`
wrote, with its map or without: a row for each braking, the rail over place and date, and where it was low.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ..bag import BagReader, choose_train, left_out, select_from
from ..command.checks import refuse
from ..command.options import (
    DONE,
    FAILED,
    help_texts,
    json_option,
    out_option,
    printable,
    remap_option,
    report,
    run_tool,
    setting_options,
)
from ..command.written import write_text
from ..core.physics.train import KMH, Train
from ..core.setting import settings_of
from ..run.offline import parameters_of
from ..run.results.rows import Write, rows_to
from ..wire.settings.nodes import TRAIN_FILE
from ..wire.settings.setup import Setup, setup_of
from ..wire.settings.shared import AMBIENT, DIRECTION
from .drawn.page import report_page
from .drawn.page_data import Subject
from .drawn.table import table
from .fleet import is_table
from .found.distances import FIXED_MU
from .found.findings import findings
from .found.rows import KEYS, rows_of
from .read.estimated import estimate_run
from .read.numbers import odd
from .read.recorded import RESULTS, read_run

RECORDED = "as recorded"
"""Where the results of a run are from."""

AS_RECORDED = "results are shown as recorded"

HEEDED = frozenset(one.name for one in (AMBIENT, DIRECTION, TRAIN_FILE, *settings_of(Train, "train.")))
"""Settings that count for results as recorded, too: how the recording is read, and the train by its papers."""

PICTURES = (".png", ".pdf")

EXAMPLES = (
    "report my_run --output my_report",
    "report before after --output both --target 100 --set train.mass_kg=400000",
    "report brakings.parquet rail.parquet --output fleet",
)


def main(args: Sequence[str] | None = None) -> int:
    """Run `report BAG... --output DIR`."""
    return run_tool(_parser(), _work, args)


def _work(options: argparse.Namespace) -> int:
    if any(map(is_table, options.bags)):
        from .fleet.command import report_fleet  # only here: a recording needs no pandas

        return report_fleet(options.bags, options)
    refuse(options, ["low"], "is for tables of brakings, not for recordings: leave it out")
    options.target = 0.0 if options.target is None else options.target
    if not 0.0 <= options.target <= 500.0:
        raise ValueError(f"target = {options.target}: give a speed from 0 to 500 km/h")
    if options.out and len(options.bags) > 1:
        raise ValueError(f"out = {options.out}: holds the estimates of one recording, {len(options.bags)} are given")
    given = parameters_of(options)
    setup, output = setup_of(given), Path(options.output)
    subjects = [_subject(path, printable(name), options, setup) for path, name in _named(options.bags)]
    if all(subject.source == RECORDED for subject in subjects):
        refuse(options, ["seed", "remap"], f"{AS_RECORDED}: add --estimate, or leave this out")
        _refuse_unheeded(options)
    else:
        for remark in setup.unread:
            print(f"report: {remark}", file=sys.stderr)
    page = _page(output, subjects, options, given)
    from .drawn.picture import draw  # only now: what the messages and the page took is free, and no table is drawn

    result: dict[str, Any] = {"page": str(page), "train": setup.train, "runs": []}
    texts, identified = [f"train: {setup.train}"], False
    for subject in subjects:
        pictures = [output / f"{subject.name}{ending}" for ending in PICTURES]
        draw(subject.run, pictures, subject.name, options.target, subject.config.train)
        found = findings(subject.run, setup.config, options.target)
        result["runs"].append(
            {"name": subject.name, "source": subject.source, "pictures": list(map(str, pictures)), **found}
        )
        for remark in subject.remarks:
            if remark != found["why"]:
                print(f"report: {subject.name}: {remark}", file=sys.stderr)
        if found["why"] is not None:
            print(f"report: {subject.name}: nothing is identified: {found['why']}", file=sys.stderr)
        identified |= found["why"] is None
        texts.append(f"{subject.name}, {subject.source}\n{table(subject.run, options.target, subject.config.train)}")
    written = filter(None, (str(page), options.out))
    report(options.json, result, "\n\n".join([*texts, "\n".join(written)]))
    return DONE if identified else FAILED


def _refuse_unheeded(options: argparse.Namespace) -> None:
    """Raise ValueError for a setting that would be of no effect; of a file of settings only say what counts."""
    options.set = [text for text in options.set if text.partition("=")[0] not in HEEDED]
    refuse(options, ["set"], f"{AS_RECORDED}: add --estimate, or leave this out")
    if options.params:
        counts = "only the train, direction and ambient_pressure_pa count"
        print(f"report: {AS_RECORDED}: of {options.params} {counts}; --estimate heeds all", file=sys.stderr)


def _page(output: Path, subjects: Sequence[Subject], options: argparse.Namespace, given: Mapping[str, Any]) -> Path:
    html = report_page(", ".join(subject.name for subject in subjects), subjects, options.target, given)
    output.mkdir(parents=True, exist_ok=True)
    page = output / "report.html"
    write_text(page, html)
    return page


def _subject(path: Path, name: str, options: argparse.Namespace, setup: Setup) -> Subject:
    targets = (0.0, options.target * KMH)
    remarks: tuple[str, ...] = ()
    with BagReader(path) as reader, _rows(options) as write:
        for loss in reader.damage:
            print(f"report: {loss}", file=sys.stderr)
        if not options.remap:
            choose_train(reader, options.namespace)
        if all(reader.resolve(topic.name) for topic in RESULTS) and not options.estimate:
            for hint in reader.left_out:
                print(f"report: {name}: {hint}", file=sys.stderr)
            run, source = read_run(reader, setup.line, KEYS if options.out else (), targets), RECORDED
            lost: Mapping[str, int] = reader.undecodable
            if told := odd(run.counts):
                print(f"report: {name}: its diagnostics tell no number: {told}: left out", file=sys.stderr)
            for row in rows_of(run, setup.line.sign) if options.out else ():
                write(row)
        else:
            selection = select_from(reader, options.remap, namespace=options.namespace)
            for hint in left_out(reader, selection):
                print(f"report: {name}: {hint}", file=sys.stderr)
            run, lost, remarks = estimate_run(reader, selection, setup, write, targets)
            source = "estimated from the recorded sensors"
        for topic, count in lost.items():
            print(f"report: {topic}: {count} messages do not decode and are left out", file=sys.stderr)
        return Subject(name, source, run, setup.config, setup.train, remarks)


@contextmanager
def _rows(options: argparse.Namespace) -> Iterator[Write]:
    """What takes the estimates as rows; a folder that is made for them goes where an error ends it."""
    missing: list[Path] = []
    if options.out:
        folder = Path(options.out).resolve().parent
        missing = [each for each in (folder, *folder.parents) if not each.exists()]
        folder.mkdir(parents=True, exist_ok=True)
    try:
        with rows_to(options.out) as write:
            yield write
    except BaseException:
        for each in missing:
            with suppress(OSError):  # another has put something in it meanwhile
                each.rmdir()
        raise


def _named(paths: Sequence[str]) -> Iterator[tuple[Path, str]]:
    """Yield the recordings under the last part of their path, numbered where that is there already."""
    taken: list[str] = []
    for path in map(Path, paths):
        name = path.resolve().stem
        taken.append(name)
        yield path, name if taken.count(name) == 1 else f"{name} ({taken.count(name)})"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("report", parents=[json_option()], **help_texts(__doc__, *EXAMPLES))
    add = parser.add_argument
    add("bags", metavar="BAG", nargs="+", help="a rosbag2 directory, an .mcap or a .db3 file, finished or not; tables")
    add("--output", metavar="DIR", required=True, help="folder of the report; one that is there is written over")
    add("--target", metavar="KMH", type=float, help="speed to which distances count (default: 0)")
    add("--estimate", action="store_true", help="estimate anew, whatever results the recording holds")
    low = f"of tables: an adhesion below it is a low spot (default: {FIXED_MU:g})"
    add("--low", metavar="MU", type=float, help=low)
    out_option(add)
    remap_option(add)
    setting_options(add)
    return parser


if __name__ == "__main__":
    raise SystemExit(main())

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study NAME`: reproduces the figures of the papers."""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from ..command.options import DONE, FAILED, help_texts, json_option, report, run_tool
from ..command.signals import interrupted, stop_on_signals

PURPOSE = "Reproduces the figures of the papers, and shows what follows from them."

STUDIES = {
    "distances": ("xie.distances", "braking distances and times beside the published ones", "--runs 200"),
    "tables": (
        "xie.tables",
        "Tables 2 and 3: accuracy over Monte-Carlo runs, beside two Kalman filters",
        "--runs 200 --figures figures",
    ),
    "sensitivity": ("xie.sensitivity", "the same against position noise, window, step and particles", "--runs 10"),
    "robust": (
        "robust.study",
        "the method `rail_condition` where rail, sensors or train are not what it believes, and under faults",
        "--runs 40",
    ),
    "real": (
        "real.study",
        "the estimator on trains, rails and sensors that share no model with it, held against goals",
        "--runs 20 --only leaves,wet --figures figures",
    ),
    "worlds": (
        "worlds.study",
        "the estimator on trains, rails, brakings and sensors that are drawn at random",
        "--runs 20 --json worlds.json",
    ),
    "remembered": (
        "real.remembered",
        "the safe curve at the first second of braking, with what earlier trains saw of the rail and without",
        "--runs 4",
    ),
    "bound": ("bound.study", "the posterior Cramér-Rao bound of mu over a braking", "--json -"),
    "intervention": (
        "intervention.study",
        "where the ATP monitor brakes by the identified adhesion and by fixed values",
        "--json table.json --figures figures",
    ),
    "safety": (
        "safety.study",
        "trains that need more way than they have left, and whether the ATP monitor says so, whatever goes wrong",
        "--cases 1000000 --json safety.json",
    ),
    "creep": (
        "he.study",
        "the creep curve: three experiments of the paper and what it leaves out",
        "--runs 20 --figures figures",
    ),
    "tune-ekf": ("xie.tune_ekf", "the search behind the tuned Kalman filter of the tables", "--runs 10"),
}
"""Module, what it shows, and options of an example. A module is loaded where its study is asked for."""


class _Study(argparse.ArgumentParser):
    """The parser of one study: what it does not know it refuses itself, with its own usage."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As every parser does; what is left over is an error."""
        known, rest = super().parse_known_args(args, namespace)
        if rest:
            self.error(f"unrecognized arguments: {' '.join(rest)}")
        return known, rest


def main(args: Sequence[str] | None = None) -> int:
    """Run one study."""
    with stop_on_signals() as stop:  # a study's module brings numpy and numba, whose import no Ctrl-C may cut off
        parser = _parser(sys.argv[1:] if args is None else args)
    return interrupted(parser.prog) if stop.requested else run_tool(parser, _run, args)


def _parser(args: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser of all studies; those that `args` name, or a shell asks for, have their options."""
    parser = argparse.ArgumentParser("study", **help_texts(PURPOSE, *(f"study {name}" for name in STUDIES)))
    studies: Any = parser.add_subparsers(metavar="NAME", required=True, parser_class=_Study)
    asked = {*args, *os.environ.get("COMP_LINE", "").split()}
    for name, (module, summary, options) in STUDIES.items():
        study = import_module(f".{module}", __package__) if name in asked else None
        texts = help_texts((study and study.__doc__) or summary, f"study {name}", f"study {name} {options}")
        own = studies.add_parser(name, help=summary, parents=[json_option()], **texts)
        if study:
            study.add_options(own)
            own.set_defaults(run=study.run)
    return parser


def _run(options: argparse.Namespace) -> int:
    """Report the rows and the text that the study gives, and say which figures it has drawn; a counterexample fails."""
    folder: Path | None = getattr(options, "figures", None)
    before = _written(folder)
    rows, text = options.run(options)
    report(options.json, rows, text)
    for path, when in sorted(_written(folder).items()):
        if before.get(path) != when:
            print(f"written: {path}", file=sys.stderr)
    return FAILED if any(row.get("counterexamples") for row in rows) else DONE


def _written(folder: Path | None) -> dict[Path, int]:
    """When the files of a folder were written; none where there is no folder."""
    return {} if folder is None else {path: path.stat().st_mtime_ns for path in folder.glob("*") if path.is_file()}


if __name__ == "__main__":
    raise SystemExit(main())

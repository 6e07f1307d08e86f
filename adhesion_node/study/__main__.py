"""`study NAME`: reproduces the figures of the papers."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from ..cli import json_option, run_tool
from . import creep, distances, intervention, sensitivity, tables, tune_ekf

STUDIES = {
    "distances": (distances, "braking distances and times beside the published ones"),
    "tables": (tables, "Tables 2 and 3: accuracy over Monte-Carlo runs, beside two Kalman filters"),
    "sensitivity": (sensitivity, "the same against position noise, window, step and particles"),
    "intervention": (intervention, "where the ATP monitor brakes by the identified adhesion and by fixed values"),
    "creep": (creep, "the creep curve: three experiments of the paper and what it leaves out"),
    "tune-ekf": (tune_ekf, "the search behind the tuned Kalman filter of the tables"),
}


def main(args: Sequence[str] | None = None) -> int:
    """Run one study."""
    parser = argparse.ArgumentParser("study", description="Reproduces the figures of the papers.")
    studies = parser.add_subparsers(metavar="NAME", required=True)
    for name, (study, summary) in STUDIES.items():
        own = studies.add_parser(name, help=summary, description=study.__doc__, parents=[json_option()])
        study.add_options(own)
        own.set_defaults(run=study.run)
    return run_tool(parser, lambda options: int(options.run(options)), args)


if __name__ == "__main__":
    raise SystemExit(main())

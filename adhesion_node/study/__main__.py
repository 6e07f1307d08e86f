"""`study NAME`: reproduces the figures of the papers."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from ..cli import json_option, run_tool
from . import creep, distances, tables, tune_ekf


def main(args: Sequence[str] | None = None) -> int:
    """Run one study."""
    parser = argparse.ArgumentParser("study", description="Reproduces the figures of the papers.")
    studies = parser.add_subparsers(metavar="NAME", required=True)
    summary = "braking distances and times beside the published ones"
    studies.add_parser("distances", help=summary, description=distances.__doc__, parents=[json_option()]).set_defaults(
        run=distances.run
    )
    summary = "the creep curve: three experiments of the paper and what it leaves out"
    creep_parser = studies.add_parser("creep", help=summary, description=creep.__doc__, parents=[json_option()])
    creep.add_options(creep_parser)
    creep_parser.set_defaults(run=creep.run)
    summary = "Tables 2 and 3: accuracy over Monte-Carlo runs, beside two Kalman filters"
    tables_parser = studies.add_parser("tables", help=summary, description=tables.__doc__, parents=[json_option()])
    tables.add_options(tables_parser)
    tables_parser.set_defaults(run=tables.run)
    summary = "the search behind the tuned Kalman filter of the tables"
    tune_parser = studies.add_parser("tune-ekf", help=summary, description=tune_ekf.__doc__, parents=[json_option()])
    tune_ekf.add_options(tune_parser)
    tune_parser.set_defaults(run=tune_ekf.run)
    return run_tool(parser, lambda options: int(options.run(options)), args)


if __name__ == "__main__":
    raise SystemExit(main())

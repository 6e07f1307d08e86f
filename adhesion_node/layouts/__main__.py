# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`python -m adhesion_node.layouts`: the layouts of Foxglove and PlotJuggler, for a namespace."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from ..command.options import DONE, help_texts, run_tool
from . import NAMES, layout

EXAMPLES = ("python -m adhesion_node.layouts --namespace /train1 --output my_layouts",)


def main(args: Sequence[str] | None = None) -> int:
    """Write the layouts into a folder."""
    parser = argparse.ArgumentParser("python -m adhesion_node.layouts", **help_texts(__doc__, *EXAMPLES))
    parser.add_argument("--namespace", default="", metavar="NAME", help="of the nodes, as /train1 (default: none)")
    parser.add_argument("--output", type=Path, default=Path(), metavar="DIR", help="default: the present folder")
    return run_tool(parser, _work, args)


def _work(options: argparse.Namespace) -> int:
    options.output.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        path = options.output / name
        path.write_text(layout(name, options.namespace), encoding="utf-8")
        print(path)
    return DONE


if __name__ == "__main__":
    raise SystemExit(main())

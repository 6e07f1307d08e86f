# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Where the figures of a study go, and in which format; without what draws them."""

import argparse
from pathlib import Path
from typing import NamedTuple

FORMATS = ("png", "pdf", "svg")


class Figures(NamedTuple):
    """Where figures go, and in which of `FORMATS`."""

    folder: Path
    ending: str = "png"

    def path(self, stem: str) -> Path:
        """Path of a figure; the folder is made when missing."""
        self.folder.mkdir(parents=True, exist_ok=True)
        return self.folder / f"{stem}.{self.ending}"


def add_figure_options(parser: argparse.ArgumentParser, what: str) -> None:
    """Options of a study that draws."""
    parser.add_argument("--figures", type=Path, metavar="DIR", help=f"draw {what} into DIR")
    parser.add_argument("--format", choices=FORMATS, default="png", help="of the figures (default %(default)s)")


def figures_of(options: argparse.Namespace) -> Figures | None:
    """What the options ask for."""
    return Figures(options.figures, options.format) if options.figures else None

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Where the figures of a study go, in which format and how wide; without what draws them."""

import argparse
from pathlib import Path
from typing import NamedTuple

from ...command.checks import refuse

FORMATS = ("png", "pdf", "svg")

COLUMN_MM, PAGE_MM = 85, 170
"""Width of a column of a journal, and of both."""


class Place(NamedTuple):
    """Where a figure goes, and how wide it is."""

    path: Path
    width_mm: float = PAGE_MM


class Figures(NamedTuple):
    """Where figures go, in which of `FORMATS`, and how wide they are."""

    folder: Path
    ending: str = "png"
    width_mm: float = PAGE_MM

    def place(self, stem: str) -> Place:
        """Place of a figure; the folder is made when missing."""
        self.folder.mkdir(parents=True, exist_ok=True)
        return Place(self.folder / f"{stem}.{self.ending}", self.width_mm)


def add_figure_options(parser: argparse.ArgumentParser, what: str) -> None:
    """Options of a study that draws."""
    parser.add_argument("--figures", type=Path, metavar="DIR", help=f"draw {what} into DIR")
    parser.add_argument("--format", choices=FORMATS, help=f"of the figures (default: {FORMATS[0]})")
    widths = f"of the figures, mm: a column of a journal, or both (default: {PAGE_MM})"
    parser.add_argument("--width", type=int, choices=(COLUMN_MM, PAGE_MM), help=widths)


def figures_of(options: argparse.Namespace) -> Figures | None:
    """What the options ask for. Raises ValueError where one means nothing: ask before what takes long."""
    if options.figures is None:
        refuse(options, ["format", "width"], "nothing is drawn without --figures: add that, or leave this out")
        return None
    return Figures(options.figures, options.format or FORMATS[0], options.width or PAGE_MM)

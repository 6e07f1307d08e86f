# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A recording that is replayed to its brakings: a task, and which are given more than once."""

import argparse
import os
import sys
from array import array
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...bag import BagReader, left_out, select_from
from ...command.running import Arrays
from ...run import offline
from ...run.pipeline import Pipeline
from ...run.results.brakings import BRAKING, CELL, brakings
from ...wire.settings.setup import setup_of

MB = 1e6


class Recording(NamedTuple):
    """A recording with the settings by which it is replayed: a task."""

    train: str
    path: str
    as_of: tuple[tuple[int, int], ...]
    """Bytes and time of change, of it and of the files that the settings name: other contents are another task."""
    settings: tuple[tuple[str, Any], ...]
    remaps: tuple[str, ...]
    namespace: str | None
    cell_m: float

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"brakings-{Path(self.path).resolve().stem}"

    @property
    def weight(self) -> float:
        """How much work it is: its size, MB."""
        return max(self.as_of[0][0] / MB, 1e-3)

    def compute(self) -> Arrays:
        """Replay it; what is wrong with it, and what is to be heard of it, are results, too."""
        told: list[str] = []
        try:
            rows, cells, placed = self._replay(told)
        except (OSError, ValueError) as error:
            return {"failed": np.array(str(error)), "told": np.array(told, np.str_)}
        found = {"rows": rows, "cells": cells, "placed": np.array(placed)}
        return {**found, "failed": np.array(""), "told": np.array(told, np.str_)}

    def _replay(self, told: list[str]) -> tuple[NDArray[np.void], NDArray[np.void], bool]:
        """Its brakings, the pieces of track of those, and whether these are known: by a speed alone they are not."""
        setup = setup_of(dict(self.settings))
        with BagReader(Path(self.path)) as reader:
            told += reader.damage
            selection = select_from(reader, self.remaps, namespace=self.namespace)
            told += left_out(reader, selection)
            recorded = offline.messages(reader, selection, setup.line)
            pipeline = Pipeline(setup.config, setup.seed)
            made = offline.predictions(pipeline, None, recorded, setup.line, array("d"))
            found = list(brakings(made, self.cell_m, setup.line.sign))
        if pipeline.last is None:
            raise ValueError(f"nothing to estimate from; dropped: {pipeline.dropped or 'nothing, it is too short'}")
        told += offline.remarks(pipeline)
        rows = np.concatenate([np.empty(0, BRAKING), *(one.row for one in found)])
        cells = [one.cells for one in found if pipeline.accepted]
        return rows, np.concatenate([np.empty(0, CELL), *cells]), pipeline.accepted > 0


def recording_of(text: str, values: dict[str, Any], options: argparse.Namespace) -> Recording:
    """The task of what is given, [TRAIN=]BAG. Raises ValueError where there is no such recording."""
    name, is_named, path = text.partition("=")
    if Path(text).exists() or not is_named:
        name, path = "", text
    if not path or not Path(path).exists():
        raise ValueError(f"bag = {path or text}: is not there")
    named = [value for value in values.values() if isinstance(value, str) and value and Path(value).is_file()]
    as_of = tuple(_as_of(Path(each)) for each in (path, *named))
    train = name or Path(path).resolve().stem
    settings, remaps = tuple(sorted(values.items())), tuple(options.remap)
    return Recording(train, path, as_of, settings, remaps, options.namespace, options.cell)


def _as_of(path: Path) -> tuple[int, int]:
    """Bytes of a file, or of a folder's files, and when they were last changed, ns."""
    files = [file for file in (path.rglob("*") if path.is_dir() else [path]) if file.is_file()]
    return sum(file.stat().st_size for file in files), max((file.stat().st_mtime_ns for file in files), default=0)


def once(tasks: Sequence[Recording]) -> list[Recording]:
    """Say which recordings are given more than once, as by overlapping patterns, and take the first of each."""
    by_place = dict[str, list[Recording]]()
    for task in tasks:
        by_place.setdefault(os.path.realpath(task.path), []).append(task)
    for first, *more in by_place.values():
        if more:
            counted = f"is given {1 + len(more)} times, and counts once, as of train {first.train}"
            print(f"brakings: {first.path}: {counted}: give it once", file=sys.stderr)
    return [first for first, *_ in by_place.values()]

# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""What studies compute: tasks that are pure functions of their fields and of the code, kept in a cache of files.

Fields and code name a task's file. So a study that was killed goes on with the tasks that are missing, and a change
of the code, of a setting or of numpy finds no stale numbers.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from functools import cache as once
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Arrays = Mapping[str, NDArray[Any]]
"""A task's result by name."""

PACKAGES = Path(__file__).parents[3]
"""The folder that holds the packages."""

SOURCES = ("adhesion_node/**/*.py", "sim_node/**/*.py")
"""Where the numbers of a task come from, below `PACKAGES`."""


class Task(Protocol):
    """Some work; its `repr` names every field that its result depends on."""

    @property
    def name(self) -> str:
        """Readable beginning of the file's name."""

    @property
    def weight(self) -> float:
        """How much work it is beside the other tasks of its study."""

    def compute(self) -> Arrays:
        """Do the work."""


def file_name(task: Task) -> str:
    """Name of the task's file in the cache."""
    text = f"{task!r} {np.__version__} {_code(PACKAGES)}"
    return f"{task.name}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.npz"


def load(task: Task, cache: Path) -> dict[str, NDArray[Any]]:
    """Read a task's result from the cache."""
    with np.load(cache / file_name(task)) as stored:
        return dict(stored)


def save(task: Task, result: Arrays, cache: Path) -> None:
    """Write a task's file; it appears whole or not at all."""
    file = cache / file_name(task)
    arrays: dict[str, Any] = dict(result)
    unfinished = file.with_suffix(f".{os.getpid()}")
    with unfinished.open("wb") as stream:
        np.savez_compressed(stream, **arrays)
    unfinished.replace(file)


@once
def _code(packages: Path) -> str:
    """Digest of the sources."""
    sources = [source for pattern in SOURCES for source in sorted(packages.glob(pattern))]
    return hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()

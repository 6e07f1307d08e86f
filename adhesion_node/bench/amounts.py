# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How much the benchmarks do: options, each heeded by some of them."""

import argparse
import math
from collections.abc import Mapping, Sequence

from ..command.checks import refuse

AMOUNTS: Mapping[str, tuple[float, str, tuple[str, ...]]] = {
    "rounds": (50, "calls of each contender", ("particle", "gaussian", "normal")),
    "journeys": (5, "brakings for the latency", ("step",)),
    "minutes": (60.0, "of simulated time for the memory", ("memory",)),
    "trains": (20, "in one process", ("trains",)),
    "seconds": (20.0, "of them on their way", ("trains",)),
    "hours": (0.5, "of the recording that is replayed and reported", ("recording", "report")),
}
"""What is usual, what it is, and the benchmarks that heed it."""


def add_amounts(parser: argparse.ArgumentParser) -> None:
    """Add them to a parser; `put_in_amounts` reads them."""
    for name, (usual, text, _) in AMOUNTS.items():
        parser.add_argument(f"--{name}", type=type(usual), help=f"{text} (default: {usual:g})")


def put_in_amounts(options: argparse.Namespace, names: Sequence[str]) -> None:
    """Put in what is usual where nothing is given; ValueError for what is out of range or none of `names` heeds."""
    for name, (usual, _, heeding) in AMOUNTS.items():
        refuse_unless(names, heeding, options, name)
        value = usual if getattr(options, name) is None else getattr(options, name)
        if not 0 < value < math.inf:
            raise ValueError(f"{name} = {value}: give a number above 0")
        setattr(options, name, value)


def refuse_unless(names: Sequence[str], heeding: Sequence[str], options: argparse.Namespace, option: str) -> None:
    """Raise ValueError for an option that was given where none of the benchmarks `names` heeds it."""
    if not set(names) & set(heeding):
        refuse(options, [option], f"is for {' and '.join(heeding)}: name one, or leave this out")

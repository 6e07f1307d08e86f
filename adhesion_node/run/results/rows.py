# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Results as data: one row per estimate, of the same columns as a file and as a frame."""

import csv
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...command.written import naming, whole
from ...core import Prediction
from ...core.bank.findings.learnt import KIND, QUANTITIES, learnt
from ...core.bank.labels.kinds import KINDS
from ...core.physics.braking import BrakingCurve
from ..pipeline import Pipeline

Row = dict[str, Any]

LEARNT = (
    *(name for quantity in QUANTITIES for name in (quantity.name, f"{quantity.name}_std")),
    *(f"{KIND}{kind.name}" for kind in KINDS),
)
"""What the bank learns of train and sensors; empty where a method of windows identifies."""

COLUMNS: Mapping[str, type[int] | type[float] | type[str]] = {
    "t_ns": int,
    **dict.fromkeys(("position_m", "position_std_m", "speed_mps", "speed_std_mps"), float),
    **dict.fromkeys(("mu", "mu_std", "mu_lower"), float),
    "regime": str,
    **dict.fromkeys(("safe_m", "nominal_m"), float),
    "braking": int,
    **dict.fromkeys(LEARNT, float),
}
"""Name and type of every column."""

CHUNK = 4096
"""Rows that wait at most until they are written to a Parquet file."""

Write = Callable[[Row], object]


def row_of(pipeline: Pipeline, made: Prediction, sign: int = 1) -> Row:
    """A row of `COLUMNS` for what the pipeline has just given; None for what is not known or withheld.

    `sign` is -1 where the chainage, which the row has, falls along the run.
    """
    e, memory = made.estimate, pipeline.state.memory
    mu = (None,) * 3 if e.withheld else (e.mu, e.mu_std, e.mu_lower)
    told = (
        *(e.t_ns, sign * e.position_m, e.position_std_m, e.speed_mps, e.speed_std_mps, *mu, e.regime.name),
        *(length_m(made.safe), length_m(made.nominal), e.window),
    )
    taught = {} if memory is None else learnt(memory)
    return dict(zip(COLUMNS, (*told, *(taught.get(name) for name in LEARNT)), strict=True))


@contextmanager
def rows_to(path: str | None) -> Iterator[Write]:
    """Give what writes rows to a CSV or, by its ending, Parquet file as they come; to nothing where there is no path.

    Raises ValueError for another ending, or without pyarrow for Parquet.
    """
    if path is None:
        yield lambda _: None
        return
    ending = Path(path).suffix.lower()
    if ending not in _FILES:
        raise ValueError(f"out = {path}: give a file that ends in {' or '.join(_FILES)}")
    with _FILES[ending](path) as write:
        yield write


@contextmanager
def _csv(path: str) -> Iterator[Write]:
    with whole(path) as part, _closed(Path(part).open("w", encoding="utf-8", newline=""), path) as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()  # waits in the file's buffer

        def write(row: Row) -> None:
            with naming(path):
                writer.writerow(row)

        yield write


@contextmanager
def _parquet(path: str) -> Iterator[Write]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise ValueError(f"out = {path}: needs pyarrow, pip install '.[parquet]', or write a .csv") from error
    kinds = {int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.dictionary(pyarrow.int32(), pyarrow.string())}
    schema = pyarrow.schema([(name, kinds[kind]) for name, kind in COLUMNS.items()])
    waiting: list[Row] = []
    with whole(path) as part:
        with naming(path):
            opened = parquet.ParquetWriter(part, schema)
        with _closed(opened, path) as writer:

            def flush() -> None:
                with naming(path):
                    writer.write_table(pyarrow.Table.from_pylist(waiting, schema))
                waiting.clear()

            def write(row: Row) -> None:
                waiting.append(row)
                if len(waiting) >= CHUNK:
                    flush()

            yield write
            flush()


@contextmanager
def _closed(file: Any, path: str) -> Iterator[Any]:
    """Close what was opened; on a full disk it is then that the last rows do not fit."""
    try:
        yield file
    finally:
        with naming(path):
            file.close()


def length_m(curve: BrakingCurve | None) -> float | None:
    """Way to the standstill, m; None where there is no curve."""
    return None if curve is None else float(curve.distance_m[-1])


_FILES = {".csv": _csv, ".parquet": _parquet}

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The report of many brakings: the tables that the program `brakings` wrote, as one page."""

from pathlib import Path

ENDINGS = (".csv", ".parquet")


def is_table(path: str) -> bool:
    """Whether it is a table rather than a recording."""
    return Path(path).suffix.lower() in ENDINGS

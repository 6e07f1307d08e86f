# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Recordings: rosbag2 directories of MCAP files, written so that an interrupted one stays readable."""

from .reader import BagReader
from .recordings import Record
from .selection import parse_remap, select, select_from
from .types import deserialize, encode, serialize, typestore
from .writer import BagWriter, Limits

__all__ = [
    "BagReader",
    "BagWriter",
    "Limits",
    "Record",
    "deserialize",
    "encode",
    "parse_remap",
    "select",
    "select_from",
    "serialize",
    "typestore",
]

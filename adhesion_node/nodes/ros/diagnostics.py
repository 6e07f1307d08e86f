# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A node's entry in /diagnostics: what an operator must know, in words with the remedy, and the numbers behind it."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from adhesion_node.core.atp.supervision import Severity
from adhesion_node.wire.results import Status
from adhesion_node.wire.topics import DIAGNOSTICS

from .types import new

JUMP_NS = 60_000_000_000
"""A stamp further back than this belongs to another time; within it stamps must not go back."""


class Finding(NamedTuple):
    """Something that an operator must know."""

    severity: Severity
    text: str


def status_message(t_ns: int, name: str, findings: Iterable[Finding], values: Mapping[str, str]) -> Any:
    """Build the status of `name` at `t_ns`: as bad as the worst finding, which its message begins with."""
    sorted_ = sorted(findings, key=lambda finding: -finding.severity)
    text = "; ".join(finding.text for finding in sorted_)
    return DIAGNOSTICS.build(new, t_ns, Status(name, sorted_[0].severity, text, values))


def next_stamp(t_ns: int, before_ns: int) -> int:
    """Return a stamp for `t_ns` that comes after the one before, unless time itself has jumped back.

    >>> next_stamp(5, 3), next_stamp(3, 3), next_stamp(0, 3 * JUMP_NS)
    (5, 4, 0)
    """
    return t_ns if t_ns > before_ns or before_ns - t_ns > JUMP_NS else before_ns + 1

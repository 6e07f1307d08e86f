# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What the chaos command counts: it would see what a recording lacks, and a seed makes its script."""

from __future__ import annotations

import random
from itertools import islice
from pathlib import Path

import messages
import pytest
from chaos import DEEDS, SAVED_S, Done, Recorded, lost, script, table
from rclpy.serialization import serialize_message

from adhesion_node.bag import BagWriter
from adhesion_node.wire.topics import STATE

S = 10**9


def recorded(path: Path, seconds: list[int]) -> None:
    """Write a state of each second, logged when it was made."""
    with_one = BagWriter(path)
    with_one.add_topic(f"/{STATE.name}", STATE.type)
    for second in seconds:
        cdr = serialize_message(messages.state_message(second * S, 0.0, 1.0, 0.0, 1.0))
        with_one.write(f"/{STATE.name}", STATE.type, cdr, second * S)
    with_one.close()


SENT = {STATE.name: [(float(second), second * S) for second in range(100, 120)]}


@pytest.mark.parametrize(
    ("kept", "until_s", "found"),
    [
        (range(100, 120), None, (0, 19)),
        (range(105, 120), None, (0, 14)),  # it came later: its own first one counts
        ([*range(100, 110), *range(112, 120)], None, (2, 19)),
        (range(100, 115), None, (5, 19)),
        (range(100, 115), 115.0 + SAVED_S / 2, (0, 14)),  # killed: what is younger than a second may be lost
        (range(100, 112), 115.0 + SAVED_S / 2, (3, 14)),
    ],
)
def test_what_a_recording_lacks_is_counted(
    tmp_path: Path, kept: list[int], until_s: float | None, found: tuple[int, int]
) -> None:
    recorded(tmp_path / "bag", list(kept))
    missing, asked = lost(SENT, [Recorded(tmp_path / "bag", until_s)])
    assert (len(missing), asked) == found
    assert all(one.startswith("adhesion/state, ") and one.endswith(" s before the end of bag") for one in missing)


def test_a_seed_makes_the_script_and_every_deed_has_its_turn() -> None:
    first, again, other = (list(islice(script(random.Random(seed)), 2 * len(DEEDS))) for seed in (1, 1, 2))
    assert first == again != other
    assert sorted(first) == sorted([*DEEDS, *DEEDS])


def test_the_table_holds_the_longest_times_of_each_deed() -> None:
    done = [Done("stop estimator", 1.5, 0.25, 0.4, ""), Done("stop estimator", 2.5, 0.125, 0.3, "")]
    _, line = table([*done])
    assert line.split() == ["stop", "estimator", "2", "2.5", "0.2", "0.4"]

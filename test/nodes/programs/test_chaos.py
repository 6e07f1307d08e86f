# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the chaos command counts: it would see what a recording lacks, and a seed makes its script."""

from __future__ import annotations

import math
import random
from itertools import islice
from pathlib import Path

import messages
import pytest
from chaos import table
from disturbed.deeds import DEEDS, Done, script
from disturbed.kept import Kept, Recorded, kept
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
    ("held", "until_s", "lost_s", "found_s", "unsaved_s"),
    [
        (range(100, 120), math.inf, (), 0.0, 0.0),
        (range(105, 120), math.inf, (), 5.0, 0.0),  # it found its publisher later: nobody can record what was before
        ([*range(100, 110), *range(112, 120)], math.inf, (9.0, 8.0), 0.0, 0.0),
        (range(100, 115), math.inf, (), 0.0, 5.0),
        (range(100, 115), 116.5, (), 0.0, 2.0),
        ([100, 101, 105], 108.5, (3.0, 2.0, 1.0), 0.0, 3.0),
        ([], math.inf, (), 19.0, 0.0),
    ],
)
def test_what_a_recording_lacks_is_counted(
    tmp_path: Path, held: list[int], until_s: float, lost_s: tuple[float, ...], found_s: float, unsaved_s: float
) -> None:
    recorded(tmp_path / "bag", list(held))
    (found,) = kept(SENT, {STATE.name: [50.0]}, [Recorded(tmp_path / "bag", 0.0, until_s)])
    assert (found.lost_s, found.found_s, found.unsaved_s) == (lost_s, found_s, unsaved_s)
    assert len(found.faults) == len(lost_s)


def test_each_life_of_a_publisher_and_of_a_recorder_is_looked_at_alone(tmp_path: Path) -> None:
    recorded(tmp_path / "one", [100, 101, 102, 108, 109])
    recorded(tmp_path / "two", [113, 114, 116, 119])
    recordings = [Recorded(tmp_path / "one", 0.0, 109.5), Recorded(tmp_path / "two", 110.5)]
    found = list(kept(SENT, {STATE.name: [100.0, 105.0]}, recordings))
    assert [(one.bag, one.asked, one.lost_s, one.found_s, one.unsaved_s) for one in found] == [
        ("one", 3, (), 0.0, 2.0),
        ("one", 2, (), 3.0, 0.0),
        ("two", 7, (4.0, 2.0, 1.0), 2.5, 0.0),
    ]


def test_a_publisher_that_is_never_found_and_an_end_that_is_never_saved_are_faults() -> None:
    assert Kept("topic", "bag", 1, found_s=31.0).faults == ["topic: bag began 31.0 s late"]
    assert Kept("topic", "bag", 1, unsaved_s=11.0).faults == ["topic: bag lacks the last 11.0 s"]


def test_a_seed_makes_the_script_and_every_deed_has_its_turn() -> None:
    first, again, other = (list(islice(script(random.Random(seed)), 2 * len(DEEDS))) for seed in (1, 1, 2))
    assert first == again != other
    assert sorted(first) == sorted([*DEEDS, *DEEDS])


def test_the_table_holds_the_longest_times_of_each_deed() -> None:
    done = [Done("stop estimator", 1.5, 0.25, 0.4, ""), Done("stop estimator", 2.5, 0.125, 0.3, "")]
    _, line = table([*done])
    assert line.split() == ["stop", "estimator", "2", "2.5", "0.2", "0.4"]

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Messages that are late, double or stamped wrongly: the run in order, or a reset that is counted."""

from __future__ import annotations

import pytest
from faulty import S
from test_faults_estimator import MakeLine, flat, make_line, offline_digest, play, ticks

from adhesion_node.wire import topics

__all__ = ["make_line"]


def test_late_messages_within_the_lag_and_duplicates_give_the_ordered_run(make_line: MakeLine) -> None:
    lag = {"max_lag_s": 0.5}
    line = make_line(**lag)
    late = ticks("late", size=0.3, share=0.3)
    doubled = [(truth, sent * 2) for truth, sent in late]
    play(line, doubled)
    line.estimator.close()
    line.hear_all()
    in_order = sorted(flat(late), key=lambda message: message.t_ns)
    assert in_order != flat(late)
    assert line.estimator.digest == offline_digest(
        [(tick[0], (m,)) for tick, m in zip([late[0]] * len(in_order), in_order, strict=True)], **lag
    )
    assert int(line.values()["dropped.DUPLICATE"]) == sum(
        len([m for m in sent if m.topic == topics.POSITION]) for _, sent in late
    )


def test_messages_older_than_the_lag_are_dropped_and_counted(make_line: MakeLine) -> None:
    line = make_line(max_lag_s=0.1)
    play(line, ticks("late", size=0.5, share=0.3))
    line.hear_all()
    assert int(line.values()["dropped.LATE"]) > 5


@pytest.mark.parametrize("fault", ["stamps_back", "stamps_forward"])
def test_a_jump_of_the_stamps_is_one_reset_and_estimates_come_again(make_line: MakeLine, fault: str) -> None:
    line = make_line()
    play(line, ticks(fault, end_s=30.0))
    line.hear_all()
    values = line.values()
    assert values["resets"] == "1"
    assert int(values["window"]) >= 50


def test_a_paused_clock_is_one_reset_and_estimates_come_again(make_line: MakeLine) -> None:
    """The train brakes on for 13 s without the time moving: ten positions far off, and it is taken to be elsewhere."""
    line = make_line()
    run = [
        (t, tuple(m._replace(t_ns=22 * S) if t.t_ns < 35 * S else m._replace(t_ns=m.t_ns - 13 * S) for m in sent))
        if t.t_ns >= 22 * S
        else (t, sent)
        for t, sent in ticks("none", end_s=45.0)
    ]
    play(line, run)
    line.hear_all()
    values = line.values()
    assert values["resets"] == "1"
    assert int(values["window"]) >= 50

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""When the devices of the real train measure, what stamps they give and when their messages arrive."""

import numpy as np
import pytest

from sim_node.real.sensors.timing import NEVER, Spells, Timing, schedule, within


def _rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_measurements_come_at_the_rate_from_a_moment_of_the_first_period() -> None:
    starts = [schedule(Timing(rate_hz=5.0), 60.0, _rng(seed)).time_s[0] for seed in range(50)]
    assert 0.0 <= min(starts) < 0.02
    assert 0.18 < max(starts) < 0.2
    when = schedule(Timing(rate_hz=5.0), 60.0, _rng())
    assert np.diff(when.time_s) == pytest.approx(np.full(299, 0.2))
    assert when.works.all()
    assert (when.stamp_s == when.time_s).all()


def test_messages_arrive_between_the_latency_and_its_jitter_later() -> None:
    when = schedule(Timing(latency_s=0.05, jitter_s=0.04), 1000.0, _rng())
    late = when.arrival_s - when.time_s
    assert 0.05 <= late.min() < 0.051
    assert 0.089 < late.max() <= 0.09
    assert late.mean() == pytest.approx(0.07, abs=0.001)


def test_no_message_of_a_device_overtakes_another() -> None:
    when = schedule(Timing(rate_hz=50.0, jitter_s=0.3), 100.0, _rng())
    assert (np.diff(when.arrival_s) >= 0.0).all()
    assert (when.arrival_s >= when.time_s).all()


def test_history_arrives_at_its_end_with_the_stamps_of_its_measurement() -> None:
    when = schedule(Timing(history_s=4.0), 20.0, _rng())
    first = when.time_s < 3.9
    assert (when.arrival_s[first] == 4.0).all()
    assert when.stamp_s[0] < 0.1
    assert (when.arrival_s[when.time_s > 4.0] > 4.0).all()


def test_outages_last_and_recur_as_set() -> None:
    spells = Spells(every_s=20.0, shortest_s=2.0, longest_s=10.0).draw(1e5, _rng())
    lengths = np.diff(spells, axis=1)
    assert 2.0 <= lengths.min() < 2.1
    assert 9.9 < lengths.max() <= 10.0
    assert (spells[1:, 0] - spells[:-1, 1]).mean() == pytest.approx(20.0, rel=0.05)
    when = schedule(Timing(outages=Spells(20.0)), 1e4, _rng())
    assert when.works.mean() == pytest.approx(20.0 / 26.0, abs=0.03)


def test_a_spell_holds_from_its_beginning_to_before_its_end() -> None:
    times = np.array([0.9, 1.0, 1.9, 2.0, 5.0, 6.5])
    assert within(times, np.array([[1.0, 2.0], [5.0, 6.0]])).tolist() == [-1, 0, 0, -1, 1, -1]
    assert within(times, NEVER.draw(100.0, _rng())).tolist() == [-1] * 6


def test_wrong_stamps_are_off_by_the_error_for_minutes_and_arrivals_are_not() -> None:
    timing = Timing(stamp_error_s=1.0, stamp_errors=Spells(60.0, 60.0, 180.0))
    when = schedule(timing, 1e4, _rng())
    errors = np.round(when.stamp_s - when.time_s, 9)
    assert set(errors.tolist()) == {-1.0, 0.0, 1.0}
    turns = when.time_s[1:][np.diff(errors) != 0.0]
    assert (errors != 0.0).mean() == pytest.approx(120.0 / 180.0, abs=0.1)
    assert np.diff(turns).max() < 600.0
    assert (when.arrival_s - when.time_s).max() < 0.031


def test_a_setting_out_of_range_is_named() -> None:
    with pytest.raises(ValueError, match=r"timing rate_hz = 0\.0"):
        Timing(rate_hz=0.0)

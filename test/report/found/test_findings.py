# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is found in a recorded run: savings, the first identified estimate, regimes and changes, by closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slowing import FREE, read, record

from adhesion_node.core import Config
from adhesion_node.report.found.distances import distances
from adhesion_node.report.found.events import text_changes
from adhesion_node.report.found.findings import findings, first_identified
from adhesion_node.report.found.regimes import Band, bands
from adhesion_node.report.read.series import Series
from adhesion_node.wire.topics import DIAGNOSTICS


def test_savings_are_the_closed_form(tmp_path: Path) -> None:
    planned = distances(read(record(tmp_path / "bag")), 50.0, FREE)
    squares = np.maximum((80.0 - 2.0 * np.arange(20)) ** 2 - 50.0**2, 0.0)
    assert planned.saved == pytest.approx(squares / (2 * 9.8) * (1 / 0.0726 - 1 / 0.09))
    assert planned.saved_at_least == pytest.approx(squares / (2 * 9.8) * (1 / 0.0726 - 1 / 0.08))


def test_findings_are_those_of_the_first_identified_estimate(tmp_path: Path) -> None:
    """Adhesion limits from 5 s on, when 80 m/s have become 70 m/s: 36 km/h of braking, the first beyond 30."""
    run = read(record(tmp_path / "bag"))
    assert first_identified(run) == 5
    found = findings(run, Config(train=FREE), 180.0)
    assert found["identified_at_kmh"] == pytest.approx(70.0 * 3.6)
    assert (found["mu"], found["mu_lower"]) == (0.09, 0.08)
    way = (70.0**2 - 50.0**2) / (2 * 9.8)
    assert found["fixed_m"] == pytest.approx(way / 0.0726)
    assert found["saved_m"] == pytest.approx(way * (1 / 0.0726 - 1 / 0.09))
    assert found["saved_at_least_m"] == pytest.approx(way * (1 / 0.0726 - 1 / 0.08))


def test_what_was_not_recorded_is_not_found(tmp_path: Path) -> None:
    found = findings(read(record(tmp_path / "bag", DIAGNOSTICS)), Config(), 0.0)
    assert found["identified_at_kmh"] is found["saved_m"] is found["mu"] is None
    assert found["mean_relative_error_percent"] is None  # the brake limits at a true adhesion of 0.1


def test_a_regime_holds_since_the_estimate_before(tmp_path: Path) -> None:
    run = read(record(tmp_path / "bag"))
    assert bands(run) == [Band(0.0, 4.0, "COASTING"), Band(4.0, 19.0, "ADHESION_LIMITED")]


def test_changes_of_a_text() -> None:
    series = Series(np.arange(6), np.array(["", "A", "A", "B", "", "B"]))
    assert text_changes(series) == [(1, "A"), (3, "B"), (5, "B")]

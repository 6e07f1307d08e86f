# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study robust --only faults`: its figures are those of the runs, and its messages those that the simulator sends."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from messages import message_of
from tasks import computed_here

from adhesion_node.study.__main__ import main
from adhesion_node.study.robust import faults
from adhesion_node.study.robust.cases import FAULTS as CASES
from adhesion_node.study.robust.cases import Case
from adhesion_node.study.robust.faults import row
from adhesion_node.study.trial.trials import DROP, ROW, TRIAL, Results
from adhesion_node.study.trial.world import World, ticks
from adhesion_node.wire.messages.codec import plain
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.topics import ADHESION_INPUTS
from sim_node.faults.plan import FAULTS, Plan
from sim_node.train.sensors import SensorMessage, SensorSettings

ALL_SENSORS = SensorSettings(speed_std_mps=0.3, wheel_speed_std_radps=0.1)
STEP = Case("a fault from 10 to 12 s", World("tunnel_entry", plan=Plan("dropout", 10.0, 2.0), lasts_s=2.0))


def read(sent: SensorMessage, message: Any) -> Any:
    """Return what the estimator takes of a message: the sample, or why it is refused."""
    try:
        return sent.topic.read(message)
    except Rejected as refusal:
        return str(refusal)


@pytest.mark.parametrize("fault", sorted(set(FAULTS) - {"irregular"}))
def test_plain_messages_are_read_as_those_of_ros(fault: str) -> None:
    world = World("cruise", ALL_SENSORS, Plan(fault, 1.0))
    sent = [message for _, messages in ticks(world, 1) for message in messages][:400]
    assert {message.topic for message in sent} <= set(ADHESION_INPUTS)
    assert [read(m, m.build(plain)) for m in sent] == [read(m, message_of(m)) for m in sent]


def test_every_fault_of_the_simulator_stands_in_the_table() -> None:
    assert {case.world.plan.fault for case in CASES} == set(FAULTS)


def test_b_is_the_case_without_its_fault_and_with_its_settings() -> None:
    for case in CASES:
        assert case.without.world.plan.fault == "none"
        assert case.without.estimator == case.estimator
        assert case.without.without == case.without


def arrays(errors: list[float], runs: int = 1, **columns: Any) -> Results:
    """Runs with an estimate a second from 9 s on; true adhesion 0.08, standard deviation 0.001."""
    rows = np.zeros((runs, len(errors)), dtype=ROW)
    rows["seed"] = np.arange(runs)[:, None]
    rows["out_s"] = 9.0 + np.arange(len(errors))
    rows["t_ns"] = rows["out_s"] * 1e9
    rows["true_mu"], rows["std"] = 0.08, 0.001
    rows["mu"] = rows["true_mu"] + errors
    rows["lower"], rows["safe_m"], rows["true_stopping_m"] = rows["mu"] - 0.002, 1100.0, 1000.0
    rows["limited"] = rows["scored"] = True
    rows["window"] = 50
    for name, values in columns.items():
        rows[name] = values
    summary = np.array([(run, 0.0, 1, True) for run in range(runs)], dtype=TRIAL)
    return Results(rows.ravel(), summary, np.array([], dtype=DROP), np.zeros(1), np.zeros(1))


B = arrays([0.001] * 8)


def test_errors_are_those_from_the_fault_on_beside_those_of_b() -> None:
    found = row(STEP, arrays([0.5, 0.002, 0.002, 0.002, -0.004, 0.002, 0.002, 0.002]), B)
    assert found["mean_relative_error_percent"] == pytest.approx(100.0 * 0.016 / 7 / 0.08)
    assert found["b_mean_relative_error_percent"] == pytest.approx(1.25)
    assert found["ratio_to_b"] == pytest.approx(16.0 / 7)
    assert found["shift"] == pytest.approx(0.008 / 7 - 0.001)
    assert found["coverage90"] == 0.0
    assert found["lower_bound_holds"] == pytest.approx(1.0)
    assert found["lowest_difference_std"] == pytest.approx(-5.0)
    assert found["identical"] == 0.0


def test_differences_count_after_a_full_window_and_only_while_adhesion_limits() -> None:
    errors = [0.001, 0.001, 0.101, 0.101, 0.101, 0.003, 0.001, 0.091]
    limited = [True] * 7 + [False]
    found = row(STEP, arrays(errors, fresh=[0, 0, 0, 0, 49, 50, 55, 60], limited=limited, scored=limited), B)
    assert found["largest_difference_std"] == pytest.approx(2.0)
    assert found["within_3_std"] == 1.0
    assert found["identical"] == pytest.approx(2 / 7)


def test_a_short_safe_curve_and_a_high_bound_are_found() -> None:
    own = arrays([0.001] * 8, safe_m=[10.0, 1000.0, 999.0, 1001.0, np.nan, 1001.0, 1001.0, 1001.0])
    own.rows["lower"][[0, 3]] = 0.081
    found = row(STEP, own, B)
    assert found["safe_curve_holds"] == pytest.approx(5 / 6)
    assert found["shortest_safe_curve"] == pytest.approx(0.999)
    assert found["without_safe_curve"] == pytest.approx(1 / 7)
    assert found["lower_bound_holds"] == pytest.approx(6 / 7)


def test_the_slowest_run_says_when_estimates_come_again() -> None:
    own, b = arrays([0.001] * 8, runs=2), arrays([0.001] * 8, runs=2)
    own.rows["window"] = [50, 50, 50, 0, 7, 50, 50, 50, 50, 50, 50, 0, 0, 0, 7, 50]
    found = row(STEP, own, b)
    assert (found["estimate_again_s"], found["full_window_again_s"]) == (3.0, 4.0)
    own.rows["window"][-1] = 49
    assert row(STEP, own, b)["full_window_again_s"] is None


def test_what_is_withheld_counts_for_the_safe_curve_alone() -> None:
    own = arrays([0.001, 0.001, 0.5, 0.5, 0.001, 0.001, 0.001, 0.001])
    own.rows["withheld"][2:4] = True
    own.rows["safe_m"][2] = 1.0
    found = row(STEP, own, B)
    assert found["ratio_to_b"] == pytest.approx(1.0)
    assert found["safe_curve_holds"] == pytest.approx(6 / 7)


def test_changes_of_the_rail_are_counted_from_the_fault_on_and_beyond_a_reset() -> None:
    changes = [0, 1, 1, 2, 2, 0, 0, 1, 5, 5, 5, 5, 5, 5, 5, 6]
    own, b = arrays([0.001] * 8, runs=2, changes=np.reshape(changes, (2, 8))), arrays([0.001] * 8, runs=2)
    assert row(STEP, own, b)["rail_changes"] == 3


def test_a_run_counts_what_was_dropped_and_when() -> None:
    case = Case("bad", World("cruise", plan=Plan("nan", 2.0, fault_share=1.0)))
    (drop,) = case.trials(1).compute()["drops"]
    assert drop["count"] == 2 * 581  # pressure and position, 2 to 60 s
    assert (drop["reason"], drop["first_s"]) == ("NOT_FINITE", 2.0)


def test_what_was_dropped_is_told_by_the_run() -> None:
    own = arrays([0.001] * 8, runs=2)
    drops = [(0, "LATE", 4, 10.5), (1, "LATE", 2, 11.5), (1, "STUCK", 1, 12.0)]
    found = row(STEP, own._replace(drops=np.array(drops, dtype=DROP)), arrays([0.001] * 8, runs=2))
    assert found["dropped"] == {"LATE": 3.0, "STUCK": 0.5}
    assert found["told_s"] == {"LATE": 1.5, "STUCK": 2.0}


def test_the_table_as_json_and_for_people(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = [case for case in CASES if case.world.plan.fault in ("none", "duplicates")]
    monkeypatch.setattr(faults, "FAULTS", shown)
    options = ["--only", "faults", "--runs", "1", "--cache", str(tmp_path / "cache")]
    with computed_here():
        assert main(["robust", *options, "--json", str(tmp_path / "rows.json")]) == 0
    b, twice = json.loads((tmp_path / "rows.json").read_text())
    assert (b["table"], b["case"], b["fault"], b["ratio_to_b"]) == ("faults", "without a fault", "none", 1.0)
    assert b["dropped"] == {}
    assert twice["dropped"]["DUPLICATE"] > 20
    assert twice["identical"] == twice["safe_curve_holds"] == twice["ratio_to_b"] == 1.0
    assert twice["largest_difference_std"] == 0.0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert f"{b['mean_relative_error_percent']:.2f}" in lines[1]
    assert "DUPLICATE" in lines[2]

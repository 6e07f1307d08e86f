# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The search for trains that are let go on: it finds none, is not empty, and finds those of a broken monitor."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import count, islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adhesion_node.core.atp import limits, monitor, plausibility, supervision
from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.atp.received import TrainState
from adhesion_node.study import __main__ as study
from adhesion_node.study.safety import study as safety
from adhesion_node.study.safety.faults.table import FAULTS
from adhesion_node.study.safety.search import Outcome, case_of, outcome
from adhesion_node.study.safety.truth import Brake

SEED = 1


def found(fault: str, cases: int) -> list[Outcome]:
    """Go through so many cases of a fault."""
    first = list(FAULTS).index(fault)
    return [outcome(case_of(SEED, number)) for number in islice(count(first, len(FAULTS)), cases)]


@pytest.mark.parametrize("fault", FAULTS)
def test_no_train_is_let_go_on_and_the_search_is_not_empty(fault: str) -> None:
    cases = found(fault, 60)
    assert not [one for one in cases if one.counterexample]
    assert sum(one.hazardous for one in cases) >= 36
    assert sum(one.hazardous and one.free for one in cases) >= 4
    assert sum(one.untold_s > 0.0 for one in cases) >= (fault != "monitor restarted")  # one in 50 of those


def without_sigma(patch: pytest.MonkeyPatch) -> None:
    at_most = TrainState.at_most
    patch.setattr(TrainState, "at_most", lambda *of: at_most(of[0], replace(of[1], margin_sigma=0.0), of[2]))


def without_age(patch: pytest.MonkeyPatch) -> None:
    at_most = TrainState.at_most
    patch.setattr(TrainState, "at_most", lambda state, config, _: at_most(state, config, state.t_ns))


def without_acceleration(patch: pytest.MonkeyPatch) -> None:
    at_most = TrainState.at_most
    patch.setattr(TrainState, "at_most", lambda *of: at_most(of[0], replace(of[1], acceleration_mps2=0.0), of[2]))


def without_build_up(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(SupervisionConfig, "coasting_s", property(lambda _: 0.0))
    # What the truth takes the brake to need is drawn of the same settings.
    patch.setattr("adhesion_node.study.safety.drawn.Brake", lambda pulling_s, _, *of: Brake(pulling_s, 4.0, *of))


def without_fading(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(limits, "_fading", lambda _: 0.0)


def without_a_knee(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(limits, "FADING_MPS", np.inf)


def without_points(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(limits, "_between_points", lambda _: 0.0)


def without_freshness(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(plausibility, "out_of_date", lambda *_: "")


def without_course(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(plausibility.Course, "complaint", lambda *_: "")


def without_ways(patch: pytest.MonkeyPatch) -> None:
    patch.setattr("adhesion_node.wire.messages.curves.ROUNDING_M2_PER_S2", np.inf)


def without_first_speed(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(plausibility, "MAX_EXCESS_MPS", np.inf)


def without_watchdog(patch: pytest.MonkeyPatch) -> None:
    step = monitor.step
    patch.setattr(
        "adhesion_node.study.safety.search.step",
        lambda rules, known, event, now: (
            (known, None)
            if isinstance(event, monitor.Tick) and event is not monitor.Tick.TARGET
            else step(rules, known, event, now)
        ),
    )


def without_clock(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(monitor, "_at", lambda known, now, _: known._replace(latest_ns=now.ros_ns, moved_ns=now.steady_ns))


def without_order(patch: pytest.MonkeyPatch) -> None:
    heard = monitor._heard

    def in_any_order(config: SupervisionConfig, known: monitor.Known, event: monitor.Event) -> monitor.Known:
        if isinstance(event, TrainState):
            return monitor._state_heard(config, known, event, False)
        return heard(config, known, event)

    patch.setattr(monitor, "_heard", in_any_order)


def with_a_higher_limit(patch: pytest.MonkeyPatch) -> None:
    read = supervision.read

    def higher(*of: Any) -> supervision.Reading:
        reading = read(*of)
        return reading._replace(ebi_mps=reading.ebi_mps + 1.0)

    patch.setattr(supervision, "read", higher)


MUTANTS: dict[Callable[[pytest.MonkeyPatch], None], tuple[str, int]] = {
    without_sigma: ("none", 40),
    without_age: ("lost", 60),
    without_acceleration: ("frozen", 200),
    without_build_up: ("none", 40),
    without_fading: ("none", 300),
    without_a_knee: ("none", 300),
    without_points: ("none", 300),
    without_freshness: ("rail gets worse", 100),
    without_course: ("states that mislead", 60),
    without_ways: ("curve in other units", 100),
    without_first_speed: ("curve in other units", 200),
    without_watchdog: ("lost", 100),
    without_clock: ("monitor's clock", 300),
    without_order: ("states that mislead", 100),
    with_a_higher_limit: ("none", 40),
}
"""Broken monitors, the fault that shows it, and within how many cases."""


@pytest.mark.parametrize("break_it", MUTANTS)
def test_a_broken_monitor_is_found(
    break_it: Callable[[pytest.MonkeyPatch], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    break_it(monkeypatch)
    fault, cases = MUTANTS[break_it]
    first = list(FAULTS).index(fault)
    numbers = islice(count(first, len(FAULTS)), cases)
    assert any(outcome(case_of(SEED, number)).counterexample for number in numbers)


def test_the_study_ends_with_a_table_that_a_seed_makes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "safety.json"
    command = [
        "safety",
        "--cases",
        "32",
        "--seed",
        "3",
        "--cache",
        str(tmp_path),
        "--workers",
        "1",
        "--json",
        str(file),
    ]
    assert study.main(command) == 0
    rows = json.loads(file.read_text())
    assert [row["fault"] for row in rows] == [*FAULTS, "all"]
    assert rows[-1]["cases"] == sum(row["cases"] for row in rows[:-1]) == 32
    assert rows[-1]["hazardous"] >= 24
    again = [outcome(case_of(3, number)) for number in range(32)]
    assert rows[-1]["longest_s"] == max(one.untold_s for one in again)
    assert "counterexamples" in capsys.readouterr().out


def test_a_counterexample_fails_and_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found: dict[str, Any] = {name: np.zeros(32) for name in Outcome._fields}
    found["stated_s"] = np.ones(32)
    found["counterexample"] = np.arange(32) == 14
    found |= {name: found[name] > 0.0 for name in ("hazardous", "free")}
    monkeypatch.setattr(safety, "run_all", lambda *_: [found])
    assert study.main(["safety", "--cases", "32"]) == 1
    assert "counterexample: case 14 of seed 1, states that mislead" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "message"), [(["--cases", "3"], "give at least 16"), (["--seed", "-1"], "seed = -1")]
)
def test_too_few_cases_and_a_bad_seed_are_refused(
    options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert study.main(["safety", *options]) == 2
    assert message in capsys.readouterr().err

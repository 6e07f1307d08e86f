# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which methods read which setting: what is said to be of no effect is never looked at."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, ClassVar

import pytest

from adhesion_node.core import Config
from adhesion_node.core.intake.samples import Sample
from adhesion_node.core.readers import READERS, unread
from adhesion_node.core.setting import settings_of
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.study.trial.world import Refusal, received
from adhesion_node.wire.settings.setup import setup_of
from sim_node.real import known
from sim_node.real.drive import drive
from sim_node.real.plant.scenarios import SCENARIOS
from sim_node.real.sensors.fitted import FITTED

NAMES = frozenset(one.name for one in settings_of(Config))
TRAM = replace(SCENARIOS["tram_leaves"], speed_mps=10.0, demands=((2.0, 1.0),))
METHODS = ("bank", "rail_condition", "particle_em")


class Watched(Config):
    """Notes which settings are read."""

    read: ClassVar[set[str]] = set()

    def __getattribute__(self, name: str) -> Any:
        if name in NAMES:
            Watched.read.add(name)
        return object.__getattribute__(self, name)


@pytest.fixture(scope="module")
def messages() -> list[Sample]:
    """Of a tram on leaves with all its sensors, as they arrive."""
    (driven,) = drive(TRAM, FITTED["full"], [1])
    told = (received(message) for _, message in driven.messages)
    return [one for one in told if not isinstance(one, Refusal)]


@pytest.mark.parametrize("noisy", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_what_a_method_is_said_not_to_read_it_does_not_look_at(
    method: str, noisy: bool, messages: list[Sample]
) -> None:
    told = {**known.parameters(TRAM, FITTED["full"]), "method": method, "identify_noise": noisy, "iterations": 3}
    config = setup_of(told).config
    pipeline = Pipeline(Watched(**{one.name: getattr(config, one.name) for one in fields(config)}), 1)
    Watched.read.clear()  # the checks of the configuration read all
    for sample in messages:
        pipeline.push(sample)
    pipeline.finish()
    assert pipeline.windows > 10
    assert not {name for name in Watched.read if method not in READERS.get(name, METHODS)}
    assert {name for name in Watched.read if name in READERS}


def test_only_settings_and_methods_are_named() -> None:
    assert set(READERS) <= NAMES
    assert {method for readers in READERS.values() for method in readers} == set(METHODS)


def test_a_value_beside_its_default_is_told_by_name_value_and_reader() -> None:
    settings = settings_of(Config)
    said = list(unread({"particles": 50, "window": 50, "confidence": 0.9}, settings))
    assert said == ["particles = 50: method = bank does not read it, particle_em would"]
    said = list(unread({"method": "particle_em", "particles": 50, "law": "dry"}, settings))
    assert said == ["law = dry: method = particle_em does not read it, bank and rail_condition would"]


def test_a_trains_file_may_tell_what_only_some_methods_read() -> None:
    metro = {"train_file": "metro", "method": "particle_em"}
    assert setup_of(metro).unread == ()
    (said,) = setup_of({**metro, "brake_build_up_s": 1.25}).unread
    assert said.startswith("brake_build_up_s = 1.25: ")

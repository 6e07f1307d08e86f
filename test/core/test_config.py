# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The configuration: nominal values of model.md, ranges, messages, brake and noise."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, fields
from typing import Any

import pytest

from adhesion_node.core import Config
from adhesion_node.core.physics.adhesion import SNOW, WET
from adhesion_node.core.setting import Setting


def test_nominal_has_the_papers_noise() -> None:
    config = Config()
    assert (config.window, config.particles, config.iterations) == (50, 20, 50)
    assert config.position_noise_m == 0.02
    assert config.speed_noise_mps == pytest.approx(0.02 / 3.6)
    # per second: 0.02^2/0.1 and (0.02/3.6)^2/0.1 = 3.0864e-4
    assert config.motion.noise(1.0) == pytest.approx((4e-3, 3.08642e-4), rel=1e-5)


def test_is_frozen() -> None:
    name = "window"  # a name in a variable, for the type checker knows that it is frozen
    with pytest.raises(FrozenInstanceError):
        setattr(Config(), name, 3)


def test_every_setting_describes_itself_and_refuses_what_is_beyond_its_range() -> None:
    described = [f for f in fields(Config) if f.metadata]
    assert len(described) > 20
    for item in described:
        assert item.metadata["description"]
        for end in ("low", "high"):
            edge = item.metadata[end]
            if math.isfinite(edge):
                beyond: Any = edge + (1 if end == "high" else -1) * (1 if isinstance(item.default, int) else 1e-3)
                beyond *= 1 + 1e-9 if isinstance(beyond, float) and beyond > 0 and end == "high" else 1
                with pytest.raises(ValueError, match=rf"^{item.name} = .*: give a value from .* to"):
                    Config(**{item.name: beyond})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"window": 2}, "window = 2: give a value from 3 to 10000"),
        ({"window": 10, "step": 10}, "step = 10: choose less than the window, 10"),
        ({"window": 10, "step": 10.0}, r"step = 10\.0: give a value of type int"),
        ({"particles": True}, "particles = True: give a value of type int"),
        ({"confidence": 1.0}, r"confidence = 1\.0: give a value from 0\.5 to 0\.9999"),
        ({"start_mu": math.nan}, "start_mu = nan"),
        ({"low_adhesion": "mud"}, "low_adhesion = 'mud': choose one of dry, snow, wet"),
        ({"identify_noise": 1}, "identify_noise = 1: give a value of type bool"),
    ],
)
def test_refuses_by_name_value_and_remedy(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Config(**changes)


def test_what_is_allowed_is_said_by_the_ends_that_there_are() -> None:
    said = [Setting("x", 1.0, "", "m", *ends).allowed() for ends in ((), (2.0,), (-math.inf, 3.0), (2.0, 3.0))]
    assert said[:2] == ["a finite value m", "a finite value of at least 2 m"]
    assert said[2:] == ["a finite value of at most 3 m", "a value from 2 to 3 m"]


def test_brake_follows_the_measured_pressure() -> None:
    config = Config()
    assert config.brake(410e3) == pytest.approx(0.0952, abs=5e-5)
    assert config.brake(102.5e3) == pytest.approx(config.brake(410e3) / 4)
    assert config.brake(9.9e3) == config.brake(0.0) == config.brake(-500.0) == 0.0
    assert config.brake(10e3) > 0.0
    assert Config(brake_threshold_pa=0.0).brake(0.0) == 0.0


def test_brake_without_a_measurement_is_the_assumed_one() -> None:
    assert Config().brake(None) == Config().brake(410e3)
    assert Config(assumed_pressure_pa=0.0).brake(None) == 0.0


def test_low_law_by_name() -> None:
    assert Config().low_law == SNOW
    assert Config(low_adhesion="wet").low_law == WET

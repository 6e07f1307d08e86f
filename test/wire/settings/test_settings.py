# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Settings by name: every one described and bounded, checked, parsed from text, and the same as a ROS parameter."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from adhesion_node.core import Config
from adhesion_node.core.physics.track import Curve, Grade, Tunnel
from adhesion_node.core.physics.train import CRH3
from adhesion_node.core.setting import Setting
from adhesion_node.wire.line import Line
from adhesion_node.wire.settings import sensing
from adhesion_node.wire.settings.given import parse_setting
from adhesion_node.wire.settings.nodes import SETTINGS
from adhesion_node.wire.settings.setup import Setup, setup_of
from adhesion_node.wire.settings.shared import OF_LINE, OF_NODES_ALONE

OF_FILES = {"track", "track_line", "track_start_m", "train_file", "rail_map"}
"""Settings that are no number or word of the configuration."""

FREE_TEXTS = {"train_file", "rail_map", "track", "frame", "track_line", "hardware_id", "child_frame"}
"""The settings that are neither a number nor one of a few words."""

USED = [setting for setting in SETTINGS if setting not in OF_NODES_ALONE and setting.name not in OF_FILES]
"""By an offline run, too."""

NUMBERS = [setting for setting in SETTINGS if type(setting.default) in (int, float)]


def named(setting: Setting) -> str:
    return setting.name


def another(setting: Setting) -> Any:
    """Return a value that the setting allows and that is not its default."""
    default = setting.default
    if isinstance(default, bool):
        return not default
    if isinstance(default, int):  # 49 and 11 keep the step below the window
        return default - 1 if default > setting.low else default + 1
    if isinstance(default, float):
        return math.nextafter(default, setting.high)
    free = {"track": "tunnel 0 1000", "frame": "map", "hardware_id": "194 101", "child_frame": "train1"}
    return free.get(setting.name) or next(choice for choice in setting.choices if choice != default)


def in_use(setup: Setup, name: str) -> Any:
    """Return what a set-up makes of a setting."""
    if name in ("seed", "sensor_timeout_s"):
        return getattr(setup, name)
    if name.startswith(sensing.USE):
        return name.removeprefix(sensing.USE) not in setup.line.unused
    if name.startswith(sensing.LATENCY):
        return setup.line.latency_s.get(name.removeprefix(sensing.LATENCY), 0.0)
    if name in {one.name for one in OF_LINE}:
        return getattr(setup.line, name)
    group, _, field = name.rpartition(".")
    return getattr(setup.config.train if group else setup.config, field)


def test_names_are_unique() -> None:
    assert len({setting.name for setting in SETTINGS}) == len(SETTINGS)


@pytest.mark.parametrize("setting", SETTINGS, ids=named)
def test_every_setting_says_what_it_is_and_what_it_may_be(setting: Setting) -> None:
    assert setting.group
    assert len(setting.description.split()) > 1
    assert not setting.description.endswith(".")
    if isinstance(setting.default, str):
        assert setting.name in FREE_TEXTS or setting.default in setting.choices
    elif not isinstance(setting.default, bool):
        assert -math.inf < setting.low <= setting.default <= setting.high < math.inf
        assert setting.low < setting.high


def test_nothing_named_is_the_nominal_set_up() -> None:
    setup = setup_of({})
    assert setup == Setup(Config(), 1, Line("track", 101_325.0), 0.5, train=setup.train)
    assert setup.config.train == CRH3
    assert setup_of({setting.name: setting.default for setting in SETTINGS}) == setup


@pytest.mark.parametrize("setting", USED, ids=named)
def test_every_setting_is_used(setting: Setting) -> None:
    value = another(setting)
    assert value != setting.default
    changed = setup_of({setting.name: value})
    assert in_use(changed, setting.name) == value
    others = [other.name for other in USED if other != setting]
    assert [in_use(changed, name) for name in others] == [in_use(setup_of({}), name) for name in others]


def test_the_track_is_built_for_the_train() -> None:
    profile = "grade 0 2000 -10; curve 500 700 4800 12; tunnel 1000 3000"
    track = setup_of({"track": profile, "train.length_m": 400.0}).config.track
    assert track.sections == (
        Grade(0.0, 2000.0, -10.0),
        Curve(500.0, 700.0, 4800.0, 12.0),
        Tunnel(1000.0, 3000.0),
    )
    assert track.train_length_m == 400.0
    # At 800 m: -10/2000 downhill and, shorter than the train and under it, the curve's 0.0105 * 12/400.
    (resistance,) = track.specific_resistance(np.array([800.0]))
    assert resistance == pytest.approx(-0.005 + 0.0105 * 12 / 400)


@pytest.mark.parametrize("setting", NUMBERS, ids=named)
def test_a_number_beyond_its_range_is_refused_by_name(setting: Setting) -> None:
    kind = type(setting.default)
    for value in (kind(setting.low - 1), kind(setting.high * 2 + 1)):
        with pytest.raises(ValueError, match=rf"^(setting )?{setting.name} = {value!r}: ".replace("+", r"\+")):
            setup_of({setting.name: value})


@pytest.mark.parametrize("setting", NUMBERS, ids=named)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "much", True, None, [1.0]], ids=repr)
def test_what_is_no_number_is_refused_by_name(setting: Setting, value: Any) -> None:
    with pytest.raises(ValueError, match=rf"{setting.name} = "):
        setup_of({setting.name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seed", 1.0),
        ("window", 50.0),
        ("train.pads", 96.5),
        ("identify_noise", 1),
        ("identify_noise", "true"),
        ("low_adhesion", "ice"),
        ("low_adhesion", 5),
        ("frame", 5),
        ("frame", None),
        ("track", "tunnel 0"),
        ("track", "tunnel 1000 0"),
        ("track", "river 0 1000"),
        ("track", 5),
    ],
)
def test_a_wrong_type_or_word_is_refused_by_name(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=rf"{name}( =| section).*: "):
        setup_of({name: value})


def test_an_integer_serves_for_a_float() -> None:
    changed = setup_of({"train.mass_kg": 400_000, "start_mu": 0, "max_lag_s": 1}).config
    assert changed == setup_of({"train.mass_kg": 400e3, "start_mu": 0.0, "max_lag_s": 1.0}).config
    assert changed.train.mass_kg == 400e3


@pytest.mark.parametrize("name", ["windw", "mass_kg", "train.window", "train", "motion", "", "Track"])
def test_an_unknown_name_is_refused_with_those_there_are(name: str) -> None:
    with pytest.raises(ValueError, match="there is none; choose of") as refusal:
        setup_of({name: 1})
    assert f"setting {name} = 1: " in str(refusal.value)
    assert all(setting.name in str(refusal.value) for setting in SETTINGS)


def test_settings_that_contradict_each_other_are_refused() -> None:
    with pytest.raises(ValueError, match="step = 5: choose less than the window, 5"):
        setup_of({"window": 5})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("window=40", ("window", 40)),
        ("seed=-1", ("seed", -1)),
        ("start_mu=0.12", ("start_mu", 0.12)),
        ("start_mu=0", ("start_mu", 0.0)),
        ("tolerance=1e-4", ("tolerance", 1e-4)),
        ("train.mass_kg=400000", ("train.mass_kg", 400e3)),
        ("identify_noise=true", ("identify_noise", True)),
        ("identify_noise=False", ("identify_noise", False)),
        ("low_adhesion=wet", ("low_adhesion", "wet")),
        ("frame=a=b", ("frame", "a=b")),
        ("track=", ("track", "")),
        ("track=grade 0 2000 10; tunnel 0 5", ("track", "grade 0 2000 10; tunnel 0 5")),
    ],
)
def test_a_text_becomes_the_settings_type(text: str, expected: tuple[str, Any]) -> None:
    parsed = parse_setting(text)
    assert parsed == expected
    assert type(parsed[1]) is type(expected[1])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("window=forty", "setting window = 'forty': give a value of type int"),
        ("window=40.0", "setting window = '40.0': give a value of type int"),
        ("window=", "setting window = '': give a value of type int"),
        ("start_mu=0,12", "setting start_mu = '0,12': give a value of type float"),
        ("identify_noise=1", "setting identify_noise = '1': give a value of type bool"),
        ("windw=40", "setting 'windw=40': did you mean window=VALUE?"),
        ("window", "setting 'window': did you mean window=VALUE?"),
        ("zzz=1", "setting 'zzz=1': write NAME=VALUE with one of seed, frame, ambient_pressure_pa"),
        ("", "setting '': write NAME=VALUE with one of seed, frame, ambient_pressure_pa"),
    ],
)
def test_a_text_that_does_not_fit_is_refused_by_name(text: str, message: str) -> None:
    with pytest.raises(ValueError, match="setting ") as refusal:
        parse_setting(text)
    assert str(refusal.value).startswith(message)

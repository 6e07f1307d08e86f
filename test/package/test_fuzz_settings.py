# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whatever parameter files and settings hold, they end in values or in a ValueError with a message."""

from __future__ import annotations

import io
import math
import tempfile
from pathlib import Path
from typing import Any

import yaml
from breakable import EDITS, YAML_VALUES, edited, refusals_say_why
from conftest import ROOT
from hypothesis import given
from hypothesis import strategies as st

from adhesion_node.wire.files import parameters
from adhesion_node.wire.settings.given import parse_setting
from adhesion_node.wire.settings.nodes import SETTINGS
from adhesion_node.wire.settings.setup import Setup, setup_of

DEFAULTS = (ROOT / "adhesion_node" / "nodes" / "defaults.yaml").read_text(encoding="utf-8")

NAMES = st.sampled_from([setting.name for setting in SETTINGS])
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=20),
    st.sampled_from([0, -1, 10**9, 10**400, 1e308, math.nan, math.inf, "tunnel 0 1000", "grade 0 1e308 1e308", [], {}]),
    st.lists(st.integers(), max_size=2),
)


@given(text=st.text(max_size=30) | st.builds("{}={}".format, NAMES, VALUES))
def test_any_text_as_a_setting(text: str) -> None:
    with refusals_say_why():
        assert isinstance(setup_of(dict([parse_setting(text, SETTINGS)])), Setup)


@given(values=st.dictionaries(NAMES, VALUES, max_size=4))
def test_any_values_as_settings(values: dict[str, Any]) -> None:
    with refusals_say_why():
        assert isinstance(setup_of(values), Setup)
        numbers = [value for value in values.values() if isinstance(value, float)]
        assert all(map(math.isfinite, numbers)), "what is not finite is no setting"


def parameters_in(content: bytes) -> dict[str, Any] | None:
    """Return the settings in a parameter file, or None where they are refused with a message."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "params.yaml")
        path.write_bytes(content)
        with refusals_say_why():
            values = parameters.read(str(path), "estimator")
            setup_of(values)
            return values
    return None


@given(edits=EDITS)
def test_a_parameter_file_with_overwritten_pieces(edits: list[tuple[int, bytes]]) -> None:
    parameters_in(edited(DEFAULTS.encode(), edits))


@given(data=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_any_file_as_a_parameter_file(data: bytes) -> None:
    parameters_in(data)


@given(document=YAML_VALUES, node=st.sampled_from(["estimator", "/**", "**", "/estimator", "estimatr", "simulator"]))
def test_parameters_of_any_shape(document: Any, node: str) -> None:
    text = io.StringIO()
    yaml.safe_dump({node: {"ros__parameters": document}}, text)
    values = parameters_in(text.getvalue().encode())
    assert values is None or node.strip("/") in ("estimator", "**"), "a file for another node is not taken for ours"

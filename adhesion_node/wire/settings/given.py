# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Values of settings that a command line gives, by name: of `--params`, `--train` and `--set`."""

import argparse
from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any

from ...command.checks import refuse
from ...command.options import written_by
from ...command.written import require_apart
from ...core.setting import Setting
from ..files import parameters
from .nodes import RAIL_MAP, SETTINGS, TRACK_LINE, TRAIN_FILE

FILES = (TRAIN_FILE, TRACK_LINE, RAIL_MAP)
"""Settings whose values name files."""


def given(options: argparse.Namespace, node: str, settings: Sequence[Setting]) -> dict[str, Any]:
    """Values of `--params` and, before them, of `--set`, by name; ValueError where one is not read, or is written over.

    `--node` names the node whose parameters are meant where a file has them for several.
    """
    if not options.params:
        refuse(options, ["node"], "says whose of --params: add that, or leave this out")
    values = parameters.read(options.params, options.node or node) if options.params else {}
    if options.train:
        values |= {TRAIN_FILE.name: options.train}
    values |= dict(parse_setting(text, settings) for text in options.set)
    require_apart(written_by(options), [str(values[each.name]) for each in FILES if each.name in values])
    return values


def parse_setting(text: str, settings: Sequence[Setting] = SETTINGS) -> tuple[str, bool | int | float | str]:
    """Split "NAME=VALUE" and read the value as the type of its setting. Raises ValueError naming the setting.

    >>> parse_setting("start_mu=0.12")
    ('start_mu', 0.12)
    """
    name, separator, value = text.partition("=")
    setting = next((setting for setting in settings if setting.name == name), None)
    if setting is None or not separator:
        names = [each.name for each in settings]
        close = get_close_matches(name, names, n=1)
        remedy = f"did you mean {close[0]}=VALUE?" if close else f"write NAME=VALUE with one of {', '.join(names)}"
        raise ValueError(f"setting {text!r}: {remedy}")
    kind = type(setting.default)
    try:
        return name, {"true": True, "false": False}[value.lower()] if kind is bool else kind(value)
    except (ValueError, KeyError):
        raise ValueError(f"setting {name} = {value!r}: give a value of type {kind.__name__}") from None

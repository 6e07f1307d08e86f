# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Every command that the pages name is there, with the options and the parameters that they give it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from itertools import pairwise

import pytest
from test_docs import PAGES, documented, text_of
from test_package import console_scripts

MODULES = {"simulator": "sim_node.nodes.simulator", "slip_simulator": "sim_node.nodes.slip_simulator"}
MODULES |= {name: f"adhesion_node.nodes.{name}" for name in ("estimator", "creep_estimator", "atp_monitor")}
MODULES |= {name: f"adhesion_node.nodes.{name}" for name in ("recorder", "replay")}
MODULES |= {name: f"adhesion_node.tools.{name}" for name in ("import_csv", "recover")}
MODULES |= {name: f"adhesion_node.tools.{name}.__main__" for name in ("train", "brakings", "demo")}
MODULES |= {name: f"adhesion_node.{name}.__main__" for name in ("live", "report", "study", "bench")}
"""Where the programs are behind their entries."""


@cache
def help_of(program: str, *study: str) -> str:
    """Return what a program says of itself."""
    main = import_module(MODULES[program]).main
    with pytest.MonkeyPatch.context() as patch:
        said: list[str] = []
        patch.setattr("argparse.ArgumentParser._print_message", lambda _self, message, _file=None: said.append(message))
        with pytest.raises(SystemExit):
            main([*study, "--help"])
    return "".join(said)


def commands() -> Iterator[list[str]]:
    """Yield the commands of the pages as words, from the name of one of our programs on."""
    for page in PAGES:
        text = text_of(page).replace("\\\n", " ")
        blocks = re.findall(r"^```(?:ba)?sh\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
        inline = re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL))
        for line in [*(line for block in blocks for line in block.splitlines()), *inline]:
            for command in re.split(r" && |; do |; done| & ?", line):
                words = shlex.split(command, comments=True) if command.count("'") % 2 == 0 else command.split()
                words = words[3:] if words[:2] == ["ros2", "run"] else words
                words = [word.rpartition("/")[2] if index == 0 else word for index, word in enumerate(words)]
                if words and words[0] in console_scripts() and len(words) > 1:
                    yield words


def test_the_options_of_every_documented_command_are_there() -> None:
    found = list(commands())
    assert {words[0] for words in found} >= {"demo", "replay", "report", "study", "recorder", "simulator", "import_csv"}
    for words in found:
        own = words[1 : words.index("--ros-args")] if "--ros-args" in words else words[1:]
        shown = help_of(words[0], own[0]) if words[0] == "study" and not own[0].startswith("-") else help_of(words[0])
        for option in (word for word in own if word.startswith("--")):
            assert re.search(rf"{re.escape(option)}\b", shown), " ".join(words)


def test_the_parameters_of_every_documented_command_are_there() -> None:
    given = [
        (words, value) for words in commands() for flag, value in pairwise(words) if flag == "-p" and ":=" in value
    ]
    assert given
    for words, value in given:
        assert "--ros-args" in words, " ".join(words)
        name = value.partition(":=")[0]
        assert name.startswith("qos_overrides.") or name in {*documented(words[0]), "use_sim_time"}, " ".join(words)

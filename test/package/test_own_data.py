# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The README leads the owner of a log from the clone to a report of their own train in ten lines: they are run."""

from __future__ import annotations

import importlib
import shlex
from pathlib import Path
from shutil import copy

import numpy as np
import pytest
from conftest import ROOT
from test_package import console_scripts

LOG_S, BRAKES_S, SLOWS_MPS2 = 60.0, 30.0, 0.5


def lines() -> list[list[str]]:
    """The commands of the section, without comments."""
    section = (ROOT / "README.md").read_text(encoding="utf-8").partition("## Your own data")[2].partition("\n## ")[0]
    block = section.partition("```bash\n")[2].partition("```")[0]
    return [shlex.split(line, comments=True) for line in block.splitlines() if line]


def write_log(path: Path) -> None:
    """A metro at 20 m/s that brakes fully, and slides."""
    t, rng = np.arange(0.0, LOG_S, 0.1), np.random.default_rng(1)
    braked = np.maximum(t - BRAKES_S, 0.0)
    position = 20.0 * t - 0.5 * SLOWS_MPS2 * braked**2 + 0.5 * rng.standard_normal(t.size)
    rows = zip(t.tolist(), position.tolist(), np.where(braked > 0.0, 410_000, 0).tolist(), strict=True)
    path.write_text("time,position,brake_pressure\n" + "".join(f"{a:.1f},{b:.3f},{c}\n" for a, b, c in rows))


def test_the_lines_of_the_readme_end_in_a_report_of_ones_own_train(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_log(tmp_path / "log.csv")
    (venv, install, *rest) = commands = lines()
    assert len(commands) <= 10
    assert (venv[:3], install[0], venv[-1]) == (["python3", "-m", "venv"], "source", ".[tools]")
    for program, *arguments in rest:
        if program == "cp":
            copy(ROOT / arguments[0], arguments[1])
            continue
        module, function = console_scripts()[program]
        monkeypatch.setattr("sys.argv", [program, *arguments])
        assert getattr(importlib.import_module(module), function)() == 0, (program, capfd.readouterr())
    assert "train: metro, six cars" in capfd.readouterr().out
    assert "metro, six cars" in (tmp_path / "my_report" / "report.html").read_text(encoding="utf-8")
    assert len((tmp_path / "results.csv").read_text().splitlines()) > 100

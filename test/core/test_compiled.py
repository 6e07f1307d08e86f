# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Kernels are kept between runs where that is possible, and work where it is not."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from adhesion_node.core import compiled

USE = """
import numpy
from adhesion_node.core.bank.kernels.weighing import normalised
print(normalised(numpy.zeros(4))[0])
"""


def test_what_is_compiled_is_kept_in_the_cache_that_is_named(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    shown = subprocess.run([sys.executable, "-c", USE], env=environment, capture_output=True, text=True, check=True)
    assert float(shown.stdout) == pytest.approx(-1.3862943611)
    assert {path.name.partition("-")[0] for path in tmp_path.rglob("*.nbi")} >= {"weighing.normalised"}


def test_a_kernel_works_where_nothing_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[dict[str, Any]] = []

    def njit(**options: Any) -> Callable[[Any], Any]:
        asked.append(options)

        def compiling(function: Any) -> Any:
            if options.get("cache"):
                raise RuntimeError("cannot cache function: no locator available for file")  # as numba says it
            return function

        return compiling

    monkeypatch.setattr(compiled, "njit", njit)
    assert compiled.kernel(abs)(-2) == 2
    assert asked == [{"cache": True, "error_model": "numpy"}, {"error_model": "numpy"}]

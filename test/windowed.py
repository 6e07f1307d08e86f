# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Settings of the methods that work in windows, in the paper's world."""

from dataclasses import replace
from typing import Any

from adhesion_node.core import Config
from adhesion_node.study.trial.estimators import EXACT


def windowed(**settings: Any) -> Config:
    """The method `rail_condition`, which knows train and track exactly, but for these settings."""
    return replace(EXACT, **settings)

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The methods that work in windows: settings of the paper's world, and one whose numbers fail."""

from dataclasses import replace
from typing import Any

from adhesion_node.core import Config
from adhesion_node.core.methods.protocol import AnyMethod, Context, MethodWindow, Verdict
from adhesion_node.core.methods.rail_condition.method import RailCondition
from adhesion_node.study.trial.estimators import EXACT


def windowed(**settings: Any) -> Config:
    """The method `rail_condition`, which knows train and track exactly, but for these settings."""
    return replace(EXACT, **settings)


class Failing:
    """The method `rail_condition`, whose numbers fail in its n-th window."""

    def __init__(self, failure: Exception | float, at: int) -> None:
        self.inner: AnyMethod = RailCondition()
        self.summary, self.open, self.extend = "", self.inner.open, self.inner.extend
        self.failure, self.left = failure, at

    def evaluate(self, config: Config, window: MethodWindow, context: Context) -> Verdict:
        self.left -= 1
        verdict = self.inner.evaluate(config, window, context)
        if self.left:
            return verdict
        if isinstance(self.failure, Exception):
            raise self.failure
        return verdict._replace(rail=verdict.rail._replace(mu=self.failure))

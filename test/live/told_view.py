# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A view that is told of estimates and of supervision."""

from __future__ import annotations

from adhesion_node.core.atp.received import TrainState
from adhesion_node.live.view import View

S = 10**9
STATUS = {
    "level": "OVERSPEED",
    "target_position_m": "6000.000",
    "target_speed_mps": "27.778",
    "distance_to_target_m": "3500.000",
    "margin_m": "369.000",
    **{f"{name}_mps": str(value) for name, value in (("permitted", 50), ("warning", 51), ("sbi", 52), ("ebi", 54))},
    "indication_mps": "nan",
}


def estimate(
    view: View, second: int, mu: float = 0.08, regime: str = "ADHESION_LIMITED", mu_lower: float | None = None
) -> None:
    """What the estimator says each second, in its order."""
    view.adhesion("mu", mu)
    view.adhesion("mu_lower", mu - 0.005 if mu_lower is None else mu_lower)
    view.train(TrainState(1000 * S + second * S, 80.0 * second, 80.0))
    view.estimated({"regime": regime, "accepted": "9", "dropped.LATE": "2", "confidence": "0.95"}, "all is well")

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whether a train brakes as it is told to: in other units of speed or pressure, or as another train, it does not."""

from ...core.bank.findings.learnt import learnt
from ..pipeline import Pipeline
from .seen import Seen

FAR_SIGMA, SURE_SIGMA = 2.5, 2.0
"""A brake's learnt factor is odd so many of its believed standard deviations off 1, and of the learnt one."""

HARDER = 4.0 / 3.0
"""No brake gives so much more than it is told to."""


def odd_brake(seen: Seen, pipeline: Pipeline) -> str | None:
    """Say that the brake is another than it is told to be, by the deceleration or by what was learnt; None if not."""
    gives = pipeline.config.train.full_brake_mps2
    remedy = "check the units of speed and pressure, and the train (--train)"
    if seen.full_mps2 is not None and seen.full_mps2 > HARDER * gives:
        return f"the train slows by {seen.full_mps2:.2f} m/s^2, its full brake gives {gives:.2f}: {remedy}"
    taught = {} if pipeline.state.memory is None else learnt(pipeline.state.memory)
    off, std = abs(taught.get("brake_factor", 1.0) - 1.0), taught.get("brake_factor_std", 0.0)
    if off > max(FAR_SIGMA * pipeline.config.brake_error, SURE_SIGMA * std):
        part = f"{taught['brake_factor']:.2f} of what its pressure promises, {gives:.2f} m/s^2 by the full one"
        return f"the brake gives {part}: {remedy}, or the brake itself"
    return None

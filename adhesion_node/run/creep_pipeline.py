# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The way of a sample to an estimate of the creep curve, the same live and offline."""

import struct
from functools import partial
from typing import final

from ..core.creep import estimator as creep
from ..core.creep.config import CreepConfig
from ..core.creep.estimator import CreepEstimate, CreepState
from ..wire.topics import WHEEL_SPEED
from .engine import EstimatorPipeline, Verbs


@final
class CreepPipeline(EstimatorPipeline[CreepState, CreepEstimate, CreepEstimate]):
    """From samples to estimates of the creep curve."""

    anchors = (WHEEL_SPEED,)
    config: CreepConfig

    def __init__(self, config: CreepConfig) -> None:
        verbs = (creep.advance, creep.settle, creep.finish)
        super().__init__(Verbs(partial(creep.init, config), *(partial(verb, config) for verb in verbs)))
        self.config = config

    def _output(self, estimate: CreepEstimate) -> CreepEstimate:
        return estimate

    @property
    def tally(self) -> str:
        """How much has come and what was made of it, in words."""
        return f"{self.accepted} samples"

    def stamp_ns(self, output: CreepEstimate) -> int:
        """When it was so."""
        return output.t_ns

    def _bytes(self, output: CreepEstimate) -> bytes:
        whole = struct.pack("<2q", output.t_ns, output.samples)
        reals = [value for value in output if isinstance(value, float)]
        return whole + struct.pack(f"<{len(reals)}d", *reals) + output.status.name.encode()

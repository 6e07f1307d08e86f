# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A drive as the run of a simulator: its truth at a steady rate, and every message when it arrives."""

from collections.abc import Iterator
from heapq import merge
from operator import itemgetter

import numpy as np

from adhesion_node.wire.messages.parts import NS

from ..train.plant import ADHESION_LIMITED, BRAKE_LIMITED, COASTING, Truth
from ..train.sensors import SensorMessage, Tick
from .drive import START_S, Drive
from .plant.journey import PERIOD_S, Journey
from .plant.validation import slid


def truths(journey: Journey) -> list[Truth]:
    """The truth every `PERIOD_S`: mu is the adhesion that the whole train *uses*, and so is what is applied.

    Adhesion limits while at least half of the axle groups slide, or did so lately: slide protection lets them roll by
    turns.
    """
    regimes = np.where(slid(journey).mean(axis=1) >= 0.5, ADHESION_LIMITED, BRAKE_LIMITED)
    regimes = np.where((journey.demanded_pa > 0.0) & (journey.speed_mps > 0.0), regimes, COASTING)
    t_ns = np.round(journey.time_s * NS).astype(np.int64)
    used = journey.used.tolist()
    columns = (journey.position_m.tolist(), journey.speed_mps.tolist(), used, used, journey.demanded_pa.tolist())
    return [Truth(*row) for row in zip(t_ns.tolist(), *columns, regimes.tolist(), strict=True)]


def ticks(drive: Drive, period_s: float) -> Iterator[Tick]:
    """Yield the truth every `period_s` without a message, and each message when it arrives with the truth before it.

    Times and stamps count from the beginning of the journey. What is still on its way at the end is lost.
    """
    known = truths(drive.journey)
    start_ns, ends_s = round(START_S * NS), float(drive.journey.time_s[-1])
    steady = ((at_s, None) for at_s in np.arange(0.0, ends_s, period_s).tolist())
    arriving = ((at_s - START_S, message) for at_s, message in drive.messages)
    for at_s, message in merge(steady, arriving, key=itemgetter(0)):
        if at_s > ends_s:
            return
        truth = known[int(at_s / PERIOD_S + 1e-6)]._replace(t_ns=round(at_s * NS))
        yield truth, () if message is None else (_moved(message, start_ns),)


def _moved(message: SensorMessage, start_ns: int) -> SensorMessage:
    return message._replace(t_ns=message.t_ns - start_ns)

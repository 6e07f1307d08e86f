# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Pressures of a brake over time, as a gauge samples them, and what is made of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from banks import FULL_PA, S

from adhesion_node.core.bank.gear.brake import BrakeSeen
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import PressureSample

MS = S // 1000
CYLINDER, MEAN, DEMANDED = (Config(method="bank", pressure_kind=kind) for kind in ("cylinder", "mean", "demanded"))


def sampled(
    pressure: Callable[[float], float], seconds: float, every_ms: int = 100, noise_pa: float = 0.0
) -> list[PressureSample]:
    rng = np.random.default_rng(1)
    stamps = range(S, S + round(seconds * 1000) * MS, every_ms * MS)
    return [PressureSample(t, pressure((t - S) / S) + noise_pa * rng.standard_normal()) for t in stamps]


def seen(
    config: Config, samples: list[PressureSample], demand_pa: float | None = None, rolls: bool | None = None
) -> list[BrakeSeen]:
    brakes = [BrakeSeen()]
    for sample in samples:
        brakes.append(brakes[-1].after(config, [sample], demand_pa, rolls))
    return brakes[1:]


def applying(time: float) -> float:
    """Built up within 2 s."""
    return FULL_PA * min(time / 2.0, 1.0)


def cycling(period_s: float, least_pa: float) -> Callable[[float], float]:
    """From 4 s on dumped in 0.3 s, held low for half a period, and built up again, over and over."""

    def pressure(time: float) -> float:
        if time < 4.0:
            return applying(time)
        phase = (time - 4.0) % period_s
        if phase < 0.3:
            return FULL_PA + (least_pa - FULL_PA) * phase / 0.3
        if phase < 0.5 * period_s:
            return least_pa
        return least_pa + (FULL_PA - least_pa) * min((phase - 0.5 * period_s) / (0.4 * period_s), 1.0)

    return pressure


def released(time: float) -> float:
    """From 4 s on eased to 150 kPa within 0.8 s, as a valve does."""
    return applying(time) if time < 4.0 else 150e3 + (FULL_PA - 150e3) * 0.1 ** ((time - 4.0) / 0.8)

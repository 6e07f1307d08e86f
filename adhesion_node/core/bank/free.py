# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""While no brake holds the train: traction is unknown, and either changes or has been steady for long.

One hypothesis of each for every way that positions err. Whether traction has become steady, or has begun to change, is
asked every time anew, and each hypothesis takes over what the other has learnt (interacting multiple models, Blom and
Bar-Shalom 1988). So a train that cruises is known well when its braking opens, and one whose brake nothing tells of is
followed through it.
"""

from __future__ import annotations

import numpy as np

from .labels.kinds import FREE, FREE_STD, STEADY
from .layout import MU, ROUGH, SIZE, SPEED, Bank, joined

CALMED_S, STIRRED_S = 10.0, 300.0
"""In such times traction that changes becomes steady, and steady one begins to change."""

BACK_MPS = 0.3
"""Speed from which a train runs back, to within its standard deviation: it is left to its other sensors, as wheels that
turn tell no direction. Where there are none it is soon known too badly for that."""


def closed(bank: Bank) -> Bank:
    """A braking ends: what it taught of train and sensors stays, traction is unknown."""
    return either(by_noise(bank).with_fresh(MU, 0.0, FREE_STD).with_fresh(ROUGH, 0.0, 0.0))


def held(bank: Bank) -> Bank:
    """While a brake is pressed that has stopped the train: none drives it back, so what slowed it down has ended.

    Unless it surely runs back: then a grade or traction does it.
    """
    back = (bank.mean[:, SPEED] < 0.0) & (bank.mean[:, MU] > 0.0)
    if not back.any() or runs_back(bank):
        return bank
    ended = bank.with_fresh(MU, 0.0, FREE_STD)
    mean, covariance = bank.mean.copy(), bank.covariance.copy()
    mean[back], covariance[back] = ended.mean[back], ended.covariance[back]
    return bank._replace(mean=mean, covariance=covariance)


def runs_back(bank: Bank) -> bool:
    """Whether the train surely runs back."""
    return bank.mean_of(SPEED) + bank.std_of(SPEED) < -BACK_MPS


def by_noise(bank: Bank) -> Bank:
    """One hypothesis for each way that positions err, with the moments of all that say so."""
    parts = []
    for noise in np.unique(bank.noise):
        part = bank.part(bank.noise == noise)
        mean, covariance = part.moments()
        weight = np.array([np.logaddexp.reduce(part.log_weight)])
        labels = (np.array([each]) for each in (noise, 0, FREE, 0.0, 0.0))
        parts.append(Bank(mean[None], covariance[None], weight, *labels))
    return joined(parts)


def either(bank: Bank) -> Bank:
    """Each hypothesis twice, traction changing or steady, as likely."""
    return joined([bank._replace(kind=np.full_like(bank.kind, kind)) for kind in (FREE, STEADY)]).normalised()


def mixed(bank: Bank, elapsed_s: float) -> Bank:
    """With what may have become steady, or begun to change, within a time: by the moments of both."""
    weight, mean, covariance = (np.stack(np.split(each, 2)) for each in (bank.weight, bank.mean, bank.covariance))
    calmed, stirred = -np.expm1(-elapsed_s / np.array((CALMED_S, STIRRED_S)))
    joint = weight[:, None] * np.array([(1.0 - calmed, calmed), (stirred, 1.0 - stirred)])[:, :, None]
    total = joint.sum(axis=0)
    part = joint / total  # of each before, in each behind
    middle = np.einsum("ijn,inx->jnx", part, mean)
    off = mean[:, None] - middle
    spread = np.einsum("ijn,inxy->jnxy", part, covariance) + np.einsum("ijn,ijnx,ijny->jnxy", part, off, off)
    return bank.believing(middle.reshape(-1, SIZE), spread.reshape(-1, SIZE, SIZE), np.log(total.ravel()))

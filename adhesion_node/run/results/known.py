# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a published adhesion is, by what limits and by its bound."""

from ...core import Regime

KNOWN_PART = 0.75
"""From this part of it on its bound makes an adhesion known, whatever limits."""

PRIOR = "prior"
"""Of an adhesion that is only believed."""

_CLAIMED = {Regime.ADHESION_LIMITED.name: "identified", Regime.BRAKE_LIMITED.name: "atleast"}


def kind_of(mu: float, mu_lower: float, regime: str) -> str:
    """What an adhesion is: identified, at least so much as the brake uses, known whatever limits, or a prior.

    >>> [kind_of(0.08, lower, regime) for lower, regime in ((0.07, "BRAKE_LIMITED"), (0.07, "COASTING"), (0.05, ""))]
    ['atleast', 'known', 'prior']
    """
    return _CLAIMED.get(regime) or ("known" if mu_lower > KNOWN_PART * mu else PRIOR)

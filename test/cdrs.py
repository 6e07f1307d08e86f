# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Messages of sensors as recordings hold them, for tests, from plain numbers."""

from __future__ import annotations

from adhesion_node.bag import encode
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION


def position(t_ns: int, position_m: float, variance_m2: float) -> bytes:
    return encode(POSITION, t_ns, (position_m,), variance_m2)


def brake_pressure(t_ns: int, absolute_pa: float) -> bytes:
    return encode(BRAKE_PRESSURE, t_ns, (absolute_pa,))

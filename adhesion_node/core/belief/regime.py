# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which part of the motion can be seen, and so what is learnt of the adhesion."""

from enum import Enum


class Regime(Enum):
    """What limits the motion at present; the value says what that tells of the adhesion."""

    COASTING = "nothing can be learnt of the adhesion: no brake, or too little seen yet"
    BRAKE_LIMITED = "the brake limits: the adhesion is at least what it uses"
    ADHESION_LIMITED = "the adhesion limits: it is identified"

# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How the adhesion is identified in a window: each method a value behind one protocol."""

from collections.abc import Mapping
from types import MappingProxyType

from .particle_em.method import ParticleEm
from .protocol import AnyMethod
from .rail_condition.method import RailCondition

METHODS: Mapping[str, AnyMethod] = MappingProxyType({"rail_condition": RailCondition(), "particle_em": ParticleEm()})
"""By the name that the setting `method` gives. A further method is its folder and a line here."""

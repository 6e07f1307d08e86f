# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""How the adhesion is identified in a window: each method a value behind one protocol."""

from collections.abc import Mapping
from types import MappingProxyType

from .particle_em.method import ParticleEm
from .protocol import AnyMethod
from .rail_condition.method import RailCondition

METHODS: Mapping[str, AnyMethod] = MappingProxyType({"rail_condition": RailCondition(), "particle_em": ParticleEm()})
"""By the name that the setting `method` gives. A further method is its folder and a line here."""

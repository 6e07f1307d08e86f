# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Which part of the motion can be seen, and so what is learnt of the adhesion."""

from enum import Enum


class Regime(Enum):
    """What limits the motion at present; the value says what that tells of the adhesion."""

    COASTING = "nothing can be learnt of the adhesion: no brake, or too little seen yet"
    BRAKE_LIMITED = "the brake limits: the adhesion is at least what it uses"
    ADHESION_LIMITED = "the adhesion limits: it is identified"

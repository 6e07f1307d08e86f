# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""From samples of single sensors to measurements in order: the gate for time, and what is plausible."""

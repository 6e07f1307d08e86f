# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""How the adhesion is identified in a window: each method a value behind one protocol."""
